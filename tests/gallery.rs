//! Pictures of every tab, way of coloring, tool and window, in both themes. Each must show something, and something else than
//! the one before. With `NORMEND_GALLERY=<folder>` they are kept there: `scripts/gallery` does so.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::collections::BTreeSet;
use std::path::PathBuf;

use driver::{Editor, start_prepared};
use egui::{Key, Modifiers, Pos2, Vec2};
use normend_app::coloring::Coloring;
use normend_app::command::{Action, Command};
use normend_app::panels::side::SideTab;
use normend_app::settings::ThemeChoice;
use normend_core::{Parameters, Preset, Start, shapes};

/// Fewer colors are an empty picture: text alone has more shades of gray.
const LEAST_COLORS: usize = 60;

struct Gallery {
    editor: Editor,
    theme: &'static str,
    folder: Option<PathBuf>,
    last: Vec<u8>,
}

impl Gallery {
    fn new(choice: ThemeChoice, theme: &'static str) -> Option<Self> {
        let mut editor = start_prepared(1.0, |settings| settings.theme = choice, |_| None)?;
        editor.harness.set_size(Vec2::new(1360.0, 860.0));
        editor.harness.run_steps(4);
        Some(Self {
            editor,
            theme,
            folder: std::env::var_os("NORMEND_GALLERY").map(PathBuf::from),
            last: Vec::new(),
        })
    }

    fn run(&mut self, command: Command) {
        self.editor.harness.state_mut().act(command.into());
        self.editor.harness.run_steps(4);
    }

    fn color(&mut self, coloring: Coloring) {
        self.editor.harness.state_mut().act(Action::Display(coloring));
        self.editor.harness.run_steps(4);
    }

    fn shoot(&mut self, name: &str) {
        self.editor.wait("no work", |app| {
            let looks = app.suspects().and_then(|suspects| suspects.status()).is_some();
            !app.is_busy() && !looks && (app.document().is_none() || app.is_painted())
        });
        self.editor.harness.run_steps(12);
        let picture = self.editor.harness.render().unwrap();
        let colors: BTreeSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > LEAST_COLORS, "{name}: only {} colors", colors.len());
        assert_ne!(picture.as_raw(), &self.last, "{name} shows what was shown before");
        self.last = picture.as_raw().clone();
        if let Some(folder) = &self.folder {
            std::fs::create_dir_all(folder).unwrap();
            picture.save(folder.join(format!("{name}_{}.png", self.theme))).unwrap();
        }
    }

    /// A place in the view, as shares of its sides.
    fn place(&self, x: f32, y: f32) -> Pos2 {
        let view = self.editor.app().view_rect();
        view.min + view.size() * Vec2::new(x, y)
    }
}

fn gallery(choice: ThemeChoice, theme: &'static str) {
    let Some(mut gallery) = Gallery::new(choice, theme) else {
        return;
    };
    gallery.shoot("empty");
    gallery.run(Command::OpenSample);
    gallery.editor.wait_until_oriented();

    gallery.shoot("mend_before");
    let (place, _) = gallery.editor.hover_wrong_patch();
    gallery.shoot("mend_hover");
    gallery.editor.click(place);
    gallery.editor.hover(gallery.place(0.95, 0.95));
    gallery.shoot("mend_after");
    gallery.run(Command::Undo);

    for tab in SideTab::ALL {
        gallery.editor.open_tab(tab);
        gallery.shoot(&format!("tab_{}", tab.label().to_lowercase()));
    }
    gallery.editor.open_tab(SideTab::Suspects);
    gallery.run(Command::NextSuspect);
    gallery.shoot("suspect");
    gallery.run(Command::FrameAll);
    gallery.run(Command::ViewCorner);

    // Colors are of what the automatic method finds.
    let propagation = gallery.editor.app().document().unwrap().parameters();
    let estimated = Parameters {
        start: Start::Estimate,
        ..propagation
    };
    gallery.editor.harness.state_mut().act(Action::Propagate(estimated));
    gallery.editor.wait("an estimate", |app| {
        let propagation = app.document().unwrap().propagation();
        propagation.is_some_and(|propagation| propagation.parameters == estimated)
    });
    gallery.editor.open_tab(SideTab::View);
    // The sample is one file, with neither colors nor other values.
    let of_the_file = [Coloring::File, Coloring::Scalar, Coloring::Layers];
    for coloring in Coloring::ALL {
        if coloring != Coloring::Facing && !of_the_file.contains(&coloring) {
            gallery.color(coloring);
            gallery.shoot(&format!(
                "coloring_{}",
                coloring.label().to_lowercase().replace(' ', "_")
            ));
        }
    }
    gallery.color(Coloring::Facing);
    for (command, name) in [
        (Command::ToggleHair, "hair"),
        (Command::ClipBox, "clip_box"),
        (Command::Section, "section"),
        // Against the input, whose wrong seat stands left of the line.
        (Command::CompareSplit, "compare"),
    ] {
        gallery.run(command);
        gallery.shoot(name);
        gallery.run(command);
    }

    gallery.editor.open_tab(SideTab::Orient);
    gallery.editor.harness.hover_at(gallery.place(0.5, 0.6));
    gallery.editor.harness.run_steps(20);
    gallery.shoot("tool_mend");
    gallery.run(Command::LassoTool);
    let corners = [(0.35, 0.3), (0.65, 0.3), (0.7, 0.6), (0.5, 0.75), (0.32, 0.6)].map(|(x, y)| gallery.place(x, y));
    gallery.editor.harness.drag_at(corners[0]);
    for corner in corners {
        gallery.editor.harness.hover_at(corner);
        gallery.editor.harness.run_steps(2);
    }
    gallery.shoot("tool_lasso");
    gallery.editor.harness.drop_at(corners[4]);
    gallery
        .editor
        .wait("a selection", |app| !app.document().unwrap().selected().is_empty());
    gallery.shoot("selection");
    gallery.run(Command::Flip);
    gallery.editor.open_tab(SideTab::History);
    gallery.shoot("history");

    for (command, name) in [
        (Command::Shortcuts, "keys"),
        (Command::Log, "messages"),
        (Command::Palette, "palette"),
        (Command::Preferences, "preferences"),
        (Command::Screenshot, "picture"),
        (Command::Turntable, "turntable"),
        (Command::OpenPath, "open_path"),
        (Command::SaveRecipe, "save_recipe"),
        (Command::Export, "export"),
        // Leaving asks, as there are edits.
        (Command::OpenSample, "unsaved"),
        (Command::About, "about"),
    ] {
        gallery.run(command);
        gallery.shoot(&format!("window_{name}"));
        gallery.editor.key(Modifiers::NONE, Key::Escape);
        gallery.editor.harness.run_steps(2);
    }
}

/// A scan with colors and another value, the ways of coloring that show them, votes, and the question after a crash.
fn gallery_of_a_file(choice: ThemeChoice, theme: &'static str) {
    let folder = tempfile::tempdir().unwrap();
    let scan = folder.path().join("painted.ply");
    std::fs::write(&scan, painted_scan()).unwrap();
    let Some(mut gallery) = Gallery::new(choice, theme) else {
        return;
    };
    gallery.editor.harness.state_mut().act(Action::OpenScan(scan.clone()));
    gallery.editor.wait_until_oriented();
    gallery.editor.open_tab(SideTab::View);
    for coloring in [Coloring::File, Coloring::Scalar] {
        gallery.color(coloring);
        gallery.shoot(&format!(
            "coloring_{}",
            coloring.label().to_lowercase().replace(' ', "_")
        ));
    }
    gallery.color(Coloring::Facing);
    let voted = Preset::Paper.parameters();
    gallery.editor.harness.state_mut().act(Action::Propagate(voted));
    gallery.editor.wait("votes", |app| {
        let propagation = app.document().unwrap().propagation();
        propagation.is_some_and(|propagation| !propagation.voted_sources.is_empty())
    });
    gallery.editor.open_tab(SideTab::Sources);
    gallery.shoot("votes");
    gallery.run(Command::SelectAll);
    gallery.run(Command::Flip);

    gallery.editor = gallery.editor.crash_and_start(&scan);
    gallery.editor.harness.set_size(Vec2::new(1360.0, 860.0));
    gallery.editor.wait("the scan", |app| app.document().is_some());
    gallery.shoot("window_restore");
}

/// A part with colors by height and a column of intensities.
fn painted_scan() -> String {
    let part = shapes::mechanical_part(30_000);
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", part.positions.len());
    for name in [
        "float x",
        "float y",
        "float z",
        "uchar red",
        "uchar green",
        "uchar blue",
        "float intensity",
    ] {
        text += &format!("property {name}\n");
    }
    text += "end_header\n";
    for place in &part.positions {
        let stripe = (8.0 * place.z).sin();
        let shade = |share: f32| (255.0 * share.clamp(0.0, 1.0)) as u8;
        let [red, green, blue] = [0.5 + 0.4 * stripe, 0.55, 0.6 - 0.4 * stripe].map(shade);
        text += &format!(
            "{} {} {} {red} {green} {blue} {}\n",
            place.x,
            place.y,
            place.z,
            place.x * place.y + stripe
        );
    }
    text
}

#[test]
fn every_part_is_shown_in_the_dark_theme() {
    gallery(ThemeChoice::Dark, "dark");
    gallery_of_a_file(ThemeChoice::Dark, "dark");
}

#[test]
fn every_part_is_shown_in_the_light_theme() {
    gallery(ThemeChoice::Light, "light");
    gallery_of_a_file(ThemeChoice::Light, "light");
}
