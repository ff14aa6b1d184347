//! Clicks on patches in the real editor without a window: hovering, choosing a size by key and by wheel, turning, undoing.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::sync::Arc;

use egui::{Event, Key, Modifiers, PointerButton, Pos2, TouchPhase, Vec2};
use normend_app::command::Command;
use normend_core::patches::{Level, Patches};
use normend_core::{Propagation, SpanningTree};

use driver::{Editor, n_different, sphere_with_wrong_cap, start};

/// Clusters of at least 4, 16, … points: each cluster that is smaller joins the one above it in the tree. Larger clusters have
/// weaker boundaries, up to 64 points.
fn patches(tree: &SpanningTree) -> Patches {
    let n_points = tree.n_points();
    // By position: the cluster, as the position of its top.
    let mut tops: Vec<u32> = (0..n_points as u32).collect();
    let mut levels: Vec<(Vec<u32>, Vec<f32>)> = vec![(Vec::new(), vec![1.0; n_points])];
    // By position: the number of its top among all tops of the last level; level 0 is numbered by point.
    let mut numbers: Vec<u32> = tree.order().to_vec();
    for (least, strength) in [(4, 0.7), (16, 0.5), (64, 0.1), (256, 0.4)] {
        let mut sizes = vec![0; n_points];
        tops.iter().for_each(|&top| sizes[top as usize] += 1);
        let mut joined = vec![false; n_points];
        for position in (0..n_points as u32).rev() {
            let is_top = tops[position as usize] == position;
            if let Some(parent) = tree
                .parent(position)
                .filter(|_| is_top && sizes[position as usize] < least)
            {
                sizes[tops[parent as usize] as usize] += sizes[position as usize];
                joined[position as usize] = true;
            }
        }
        let n_before = levels[levels.len() - 1].1.len();
        let mut parents = vec![0; n_before];
        let mut next_numbers = vec![0; n_points];
        let mut n_clusters = 0;
        for position in 0..n_points {
            // Tops come before what is below them, so those above are final.
            let old_top = tops[position] as usize;
            let top = if joined[old_top] {
                tops[tree.parent(old_top as u32).unwrap() as usize]
            } else {
                old_top as u32
            };
            tops[position] = top;
            if top as usize == position {
                next_numbers[position] = n_clusters;
                n_clusters += 1;
            }
            next_numbers[position] = next_numbers[top as usize];
            parents[numbers[position] as usize] = next_numbers[position];
        }
        let last = levels.len() - 1;
        levels[last].0 = parents;
        levels.push((Vec::new(), vec![strength; n_clusters as usize]));
        numbers = next_numbers;
    }
    let levels: Vec<_> = levels
        .iter()
        .map(|(parents, strengths)| Level { parents, strengths })
        .collect();
    Patches::new(tree, &levels)
}

/// The editor on the sphere with a wrong cap, oriented as its file is, but with patches.
fn start_with_patches() -> Option<Editor> {
    let mut editor = start(sphere_with_wrong_cap)?;
    editor.wait_until_oriented();
    assert!(
        editor.app().availability(Command::LargerPatch).is_err(),
        "there are no patches yet"
    );
    let propagation = editor.app().document().unwrap().propagation().unwrap().clone();
    let patches = Some(Arc::new(patches(&propagation.tree)));
    editor
        .harness
        .state_mut()
        .show_propagation(Propagation { patches, ..propagation });
    editor.harness.run_steps(3);
    assert!(editor.app().availability(Command::LargerPatch).is_ok());
    Some(editor)
}

/// Waits until the preview is of another number of points than `before`, and returns it.
fn next_preview(editor: &mut Editor, before: u64) -> u64 {
    editor.wait("another preview", |app| {
        app.n_would_turn().is_some_and(|n_points| n_points != before)
    });
    editor.app().n_would_turn().unwrap()
}

fn button(editor: &mut Editor, place: Pos2, pressed: bool, modifiers: Modifiers) {
    editor.harness.event(Event::PointerButton {
        pos: place,
        button: PointerButton::Primary,
        pressed,
        modifiers,
    });
    editor.harness.run_steps(2);
}

fn wheel(editor: &mut Editor, notches: f32) {
    editor.harness.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: Vec2::new(0.0, notches),
        phase: TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    editor.harness.run_steps(2);
}

#[test]
fn keys_choose_the_patch_and_a_click_turns_what_is_shown() {
    let Some(mut editor) = start_with_patches() else { return };
    let (normals, bits) = (editor.normals(), editor.bits());
    let (place, default) = editor.hover_wrong_patch();
    assert!((64..256).contains(&default), "{default}");
    let (level, n_levels) = editor.app().patch_level().unwrap();
    assert!(1 < level && level < n_levels);
    editor.harness.run_steps(2);
    assert!(editor.shows(&format!("patch size {level} of {n_levels}")));

    editor.key(Modifiers::NONE, Key::CloseBracket);
    let larger = next_preview(&mut editor, default);
    assert!(2 * larger >= 3 * default, "{larger} after {default}");
    assert_eq!(editor.app().patch_level(), Some((level + 1, n_levels)));
    editor.key(Modifiers::NONE, Key::OpenBracket);
    assert_eq!(next_preview(&mut editor, larger), default);
    editor.key(Modifiers::NONE, Key::OpenBracket);
    let smaller = next_preview(&mut editor, default);
    assert!(smaller < default);
    assert_eq!((editor.bits(), editor.n_sources()), (bits.clone(), 0));

    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    assert_eq!(n_different(&normals, &editor.normals()), smaller);
    let source = *editor.app().document().unwrap().sources().iter().next().unwrap();
    assert_eq!(u64::from(source.patch.unwrap().n_points), smaller);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!((editor.bits(), editor.n_sources()), (bits, 0));
}

#[test]
fn the_wheel_under_a_held_button_chooses_and_the_release_turns() {
    let Some(mut editor) = start_with_patches() else { return };
    let normals = editor.normals();
    let (place, default) = editor.hover_wrong_patch();
    let picture = editor.picture();
    button(&mut editor, place, true, Modifiers::NONE);
    wheel(&mut editor, 1.0);
    let larger = next_preview(&mut editor, default);
    assert!(larger > default);
    wheel(&mut editor, -2.0);
    let smaller = next_preview(&mut editor, larger);
    assert!(smaller < default);
    // Longer than a click may take otherwise.
    editor.harness.run_steps(90);
    assert_eq!((editor.app().n_would_turn(), editor.n_sources()), (Some(smaller), 0));
    button(&mut editor, place, false, Modifiers::NONE);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    assert_eq!(n_different(&normals, &editor.normals()), smaller);
    // The camera has not moved: undone, all looks as before.
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.hover(editor.app().view_rect().left_top() + Vec2::splat(3.0));
    editor.wait("nothing highlighted", |app| app.n_would_turn().is_none());
    editor.harness.run_steps(30);
    let after = editor.picture();
    editor.hover(place);
    next_preview(&mut editor, 0);
    assert_eq!(after.width, picture.width);
    assert_eq!(
        editor.picture().rgba,
        picture.rgba,
        "the wheel zoomed, or the drag turned the view"
    );
}

#[test]
fn a_held_button_that_moves_away_is_a_drag_and_turns_nothing() {
    let Some(mut editor) = start_with_patches() else { return };
    let (place, default) = editor.hover_wrong_patch();
    button(&mut editor, place, true, Modifiers::NONE);
    wheel(&mut editor, 1.0);
    next_preview(&mut editor, default);
    let away = place + Vec2::new(40.0, 0.0);
    editor.hover(away);
    button(&mut editor, away, false, Modifiers::NONE);
    editor.harness.run_steps(10);
    assert_eq!(editor.n_sources(), 0);
}

#[test]
fn the_patch_tool_selects_what_the_wheel_chose() {
    let Some(mut editor) = start_with_patches() else { return };
    let normals = editor.normals();
    let selected = |app: &normend_app::App| app.document().unwrap().selected().len();
    editor.key(Modifiers::NONE, Key::A);
    let place = editor.app().view_rect().center();
    editor.hover(place);
    editor.wait("a patch", |app| app.patch_level().is_some());
    assert_eq!(editor.app().n_would_turn(), None, "it turns nothing");
    button(&mut editor, place, true, Modifiers::NONE);
    button(&mut editor, place, false, Modifiers::NONE);
    editor.wait("a selected patch", |app| selected(app) > 0);
    let default = selected(editor.app());
    let (level, _) = editor.app().patch_level().unwrap();
    // No double-click.
    editor.harness.run_steps(40);
    button(&mut editor, place, true, Modifiers::SHIFT);
    wheel(&mut editor, 1.0);
    editor.wait("a larger patch", |app| {
        app.patch_level().is_some_and(|(now, _)| now == level + 1)
    });
    button(&mut editor, place, false, Modifiers::SHIFT);
    editor.wait("a larger selection", |app| selected(app) > default);
    assert!(2 * selected(editor.app()) >= 3 * default);
    assert_eq!((n_different(&normals, &editor.normals()), editor.n_sources()), (0, 0));
}

#[test]
fn alt_mends_along_the_tree() {
    let Some(mut editor) = start_with_patches() else { return };
    let (place, patch) = editor.hover_wrong_patch();
    editor.harness.event(Event::ModifiersChanged(Modifiers::ALT));
    let tree = next_preview(&mut editor, patch);
    assert_eq!(editor.app().patch_level(), None);
    button(&mut editor, place, true, Modifiers::ALT);
    button(&mut editor, place, false, Modifiers::ALT);
    editor.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let document = editor.app().document().unwrap();
    assert_eq!(document.sources().iter().next().unwrap().patch, None);
    assert!(tree > 0);
    // And by key.
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.n_sources(), 0);
    editor.key(Modifiers::ALT, Key::Enter);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let document = editor.app().document().unwrap();
    assert_eq!(document.sources().iter().next().unwrap().patch, None);
}
