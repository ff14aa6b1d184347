//! From masks and other wishes to points. Every tool that draws gives a mask; two back ends turn it into points: *visible only*
//! lays it over the ids of the picture, which is exact, and *through* projects every point.
//!
//! Wishes are answered in the order they were made: the ids of a picture take a frame or more to come back, and what looks at all
//! points runs in a [`Job`].

use std::collections::VecDeque;
use std::sync::Arc;

use normend_core::document::Viewer;
use normend_core::{Document, PointCloud, PointSet, Surroundings, confidence};
use normend_render::{Camera, IdsRequest, Lens, SeenIds};
use rayon::prelude::*;

use crate::job::{Job, JobError};
use crate::scene_sync::Scene;
use crate::tools::Combine;
use crate::tools::mask::Mask;
use crate::tools::painting::Stroke;
use crate::viewport::{Viewport, viewer_of};

/// What a wish comes to.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Select these points, hidden ones left out.
    Select {
        /// What was picked.
        points: PointSet,
        /// How it joins what is selected.
        combine: Combine,
    },
    /// The points that a picture shows, for "What I see faces me".
    Seen {
        /// The points.
        points: PointSet,
        /// From where the picture that was asked is seen; the view may have moved on since.
        viewer: Viewer,
    },
    /// These points show their back in the picture.
    Backs(PointSet),
    /// Nothing, for this reason in words.
    Failed(String),
}

/// What the picture is asked for.
#[derive(Debug)]
enum OfPicture {
    Stroke(Stroke),
    Seen,
    Backs,
}

/// A wish about what is seen.
struct OfView {
    of: OfPicture,
    /// The picture from here is meant.
    camera: Camera,
    /// `None` until there is a picture in full detail to ask.
    asked: Option<Asked>,
}

/// What a picture was asked.
struct Asked {
    request: IdsRequest,
    ids_version: u64,
    /// The picture is seen from here.
    camera: Camera,
}

enum Wish {
    View(Box<OfView>),
    Through {
        job: Job<PointSet>,
        combine: Combine,
    },
    Undecided(Job<PointSet>),
    /// Select no point.
    Nothing,
    Step {
        grows: bool,
        /// With the revision of the document it was begun at.
        running: Option<(Job<Stepped>, u64)>,
    },
}

/// A selection that grew or shrank, and what was prepared for it.
struct Stepped {
    points: PointSet,
    surroundings: Arc<Surroundings>,
}

/// The wishes that are not answered yet, and what answering needs again.
#[derive(Default)]
pub struct Selecting {
    wishes: VecDeque<Wish>,
    /// For clouds with these discs.
    surroundings: Option<(Arc<Vec<f32>>, Arc<Surroundings>)>,
}

impl Selecting {
    /// Whether an answer is awaited.
    pub fn is_busy(&self) -> bool {
        !self.wishes.is_empty()
    }

    /// Forgets all wishes, as when another scan is opened.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Asks for the points that a stroke picks in the present picture: those that are seen, or with `through` all.
    pub fn stroke(
        &mut self,
        ctx: &egui::Context,
        scene: &Scene,
        viewport: &Viewport,
        document: &Document,
        stroke: Stroke,
        through: bool,
    ) {
        if stroke.mask.bounds().is_none() {
            // A click beside everything picks nothing; only in place of the selection that means something.
            if stroke.combine == Combine::Replace {
                self.wishes.push_back(Wish::Nothing);
            }
            return;
        }
        if !through {
            self.ask_picture(scene, viewport, OfPicture::Stroke(stroke));
            return;
        }
        let Some(lens) = scene.lens() else { return };
        let cloud = Arc::clone(document.cloud());
        let hidden = document.hidden().clone();
        let Stroke { mask, combine } = stroke;
        let job = Job::start(ctx, "select", "Selecting", move |progress| {
            progress.report(0.0)?;
            Ok(through_mask(&cloud, &hidden, &lens, &mask))
        });
        self.wishes.push_back(Wish::Through { job, combine });
    }

    /// Asks for all points that the present picture shows.
    pub fn seen(&mut self, scene: &Scene, viewport: &Viewport) {
        self.ask_picture(scene, viewport, OfPicture::Seen);
    }

    /// Asks for the points that show their back in the present picture.
    pub fn backs(&mut self, scene: &Scene, viewport: &Viewport) {
        self.ask_picture(scene, viewport, OfPicture::Backs);
    }

    fn ask_picture(&mut self, scene: &Scene, viewport: &Viewport, of: OfPicture) {
        // Now, if it can be: the view may move on before earlier wishes are answered.
        let asked = ask(scene, viewport, &of);
        self.wishes.push_back(Wish::View(Box::new(OfView {
            of,
            camera: *viewport.camera(),
            asked,
        })));
    }

    /// Asks for the selection to grow, or else to shrink, by about a splat.
    pub fn step(&mut self, grows: bool) {
        self.wishes.push_back(Wish::Step { grows, running: None });
    }

    /// Asks for the points that are as likely wrong as right.
    pub fn undecided(&mut self, ctx: &egui::Context, document: &Document) {
        let Some(propagation) = document.shared_propagation() else {
            return;
        };
        let job = Job::start(ctx, "select", "Looking for undecided points", move |progress| {
            progress.report(0.0)?;
            let sure = confidence::confidence(&propagation).unwrap_or_default();
            let points = (0_u32..).zip(&sure);
            let undecided = points.filter(|&(_, &sure)| sure <= confidence::UNDECIDED);
            Ok(undecided.map(|(point, _)| point).collect())
        });
        self.wishes.push_back(Wish::Undecided(job));
    }

    /// The answer to the oldest wish, once it is there. Never blocks.
    pub fn poll(
        &mut self,
        ctx: &egui::Context,
        scene: &Scene,
        viewport: &Viewport,
        document: &Document,
    ) -> Option<Answer> {
        let mut wish = self.wishes.pop_front()?;
        let answer = match &mut wish {
            Wish::View(wish) => poll_view(scene, viewport, document, wish),
            Wish::Through { job, combine } => job.poll().map(|points| select(points, *combine)),
            Wish::Nothing => Some(select(Ok(PointSet::new()), Combine::Replace)),
            Wish::Undecided(job) => job.poll().map(|points| select(points, Combine::Replace)),
            Wish::Step { grows, running } => self.poll_step(ctx, document, *grows, running),
        };
        if answer.is_none() {
            self.wishes.push_front(wish);
        }
        answer
    }

    fn poll_step(
        &mut self,
        ctx: &egui::Context,
        document: &Document,
        grows: bool,
        running: &mut Option<(Job<Stepped>, u64)>,
    ) -> Option<Answer> {
        let propagation = document.shared_propagation()?;
        if let Some((job, revision)) = running {
            let stepped = job.poll()?;
            if *revision == document.revision() {
                return Some(match stepped {
                    Ok(Stepped { points, surroundings }) => {
                        self.surroundings = Some((Arc::clone(&propagation.splat_radii), surroundings));
                        select(Ok(points), Combine::Replace)
                    }
                    Err(error) => select(Err(error), Combine::Replace),
                });
            }
        }
        // The first time, or anew because the selection or the discs changed meanwhile.
        let radii = Arc::clone(&propagation.splat_radii);
        let known = self.surroundings.as_ref().filter(|(of, _)| Arc::ptr_eq(of, &radii));
        let known = known.map(|(_, surroundings)| Arc::clone(surroundings));
        let cloud = Arc::clone(document.cloud());
        let (selected, hidden) = (document.selected() - document.hidden(), document.hidden().clone());
        let job = Job::start(ctx, "select", "Looking at what is around", move |progress| {
            let surroundings = match known {
                Some(surroundings) => surroundings,
                None => Arc::new(Surroundings::new(&cloud, &radii, progress)?),
            };
            let points = if grows {
                surroundings.grow(&selected, progress)?
            } else {
                // What is hidden neither counts as selected nor as its border.
                surroundings.shrink(&(&selected | &hidden), progress)? - &hidden
            };
            Ok(Stepped { points, surroundings })
        });
        *running = Some((job, document.revision()));
        None
    }
}

fn select(points: Result<PointSet, JobError>, combine: Combine) -> Answer {
    match points {
        Ok(points) => Answer::Select { points, combine },
        Err(JobError::Cancelled) => Answer::Failed("Nothing was selected: cancelled.".to_owned()),
        Err(JobError::Failed(reason)) => Answer::Failed(format!("{reason} Nothing was selected.")),
    }
}

fn ask(scene: &Scene, viewport: &Viewport, of: &OfPicture) -> Option<Asked> {
    let (min, size) = match of {
        OfPicture::Stroke(stroke) => {
            let [min, max] = stroke.mask.bounds()?;
            (min, [max[0] - min[0], max[1] - min[1]])
        }
        OfPicture::Seen | OfPicture::Backs => ([0, 0], viewport.view_place().size),
    };
    Some(Asked {
        request: scene.read_ids(min, size)?,
        ids_version: scene.ids_version(),
        camera: scene.drawn_camera()?,
    })
}

fn poll_view(scene: &Scene, viewport: &Viewport, document: &Document, wish: &mut OfView) -> Option<Answer> {
    let OfView { of, camera, asked } = wish;
    let mut question = match asked.take() {
        Some(question) => question,
        None if viewport.camera() != camera => {
            return Some(Answer::Failed(
                "The view moved before it was looked at: nothing was selected. Try again.".to_owned(),
            ));
        }
        None => ask(scene, viewport, of)?,
    };
    if question.ids_version != scene.ids_version() {
        // The ids mean other points now: the next picture is asked.
        return None;
    }
    let Some(seen) = scene.poll_ids(&mut question.request) else {
        *asked = Some(question);
        return None;
    };
    let viewer = viewer_of(&question.camera);
    let points = |holds: &dyn Fn([u32; 2]) -> bool| scene.points_of(&seen_where(&seen, holds));
    Some(match of {
        OfPicture::Stroke(stroke) => Answer::Select {
            points: points(&|pixel| stroke.mask.contains(pixel)),
            combine: stroke.combine,
        },
        OfPicture::Seen => Answer::Seen {
            points: points(&|_| true),
            viewer,
        },
        OfPicture::Backs => {
            let positions = document.cloud().positions();
            let shows_back = |point: &u32| {
                let toward_viewer = viewer.direction_from(positions[*point as usize]);
                let normal = document.oriented_normal(*point);
                normal.is_some_and(|normal| normal.dot(toward_viewer) < 0.0)
            };
            Answer::Backs(points(&|_| true).iter().filter(shows_back).collect())
        }
    })
}

/// The instances seen at the pixels that hold, ascending, each once.
fn seen_where(seen: &SeenIds, holds: &dyn Fn([u32; 2]) -> bool) -> Vec<u32> {
    let width = seen.size[0].max(1);
    let mut instances: Vec<u32> = (0_u32..)
        .zip(&seen.instances)
        .filter(|&(index, &instance)| {
            let pixel = [seen.min[0] + index % width, seen.min[1] + index / width];
            instance != SeenIds::NONE && holds(pixel)
        })
        .map(|(_, &instance)| instance)
        .collect();
    instances.sort_unstable();
    instances.dedup();
    instances
}

/// The points whose place in the picture is painted, seen or not; none that is hidden or cut away. O(n), in parallel.
fn through_mask(cloud: &PointCloud, hidden: &PointSet, lens: &Lens, mask: &Mask) -> PointSet {
    let is_painted = |position| {
        let pixel = lens.pixel(position);
        pixel.is_some_and(|pixel| mask.contains([pixel.x as u32, pixel.y as u32]))
    };
    let points: Vec<u32> = (cloud.positions().par_iter().enumerate())
        .filter(|&(_, &position)| is_painted(position))
        .map(|(point, _)| point as u32)
        .collect();
    points.into_iter().collect::<PointSet>() - hidden
}
