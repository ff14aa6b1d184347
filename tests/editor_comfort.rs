//! What makes the editor comfortable, without a window: the palette, hints, messages, the scale, names for all widgets.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use egui::accesskit::Role;
use egui::{Key, Modifiers, Vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use normend_app::command::Command;
use normend_app::panels::hints::Card;
use normend_app::panels::side::SideTab;
use normend_app::settings::{Settings, ThemeChoice};
use normend_app::{SettingsStore, theme};
use normend_core::Preset;

use driver::{Editor, sphere_with_wrong_cap, start, start_prepared};

fn kept(editor: &Editor) -> Settings {
    let (store, problem) = SettingsStore::load_from(&editor.folder.path().join("settings"));
    assert_eq!(problem, None);
    store.settings
}

fn find(editor: &mut Editor, letters: &str) {
    editor.key(Modifiers::COMMAND, Key::P);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, "Find a command")
        .type_text(letters);
    editor.harness.run_steps(2);
}

fn about_is_open(editor: &Editor) -> bool {
    editor.shows("An editor for the consistent orientation")
}

/// The first row of the palette.
fn first_found(editor: &Editor) -> String {
    let rows = editor.harness.query_all_by_role(Role::ListBoxOption);
    rows.min_by(|a, b| a.rect().top().total_cmp(&b.rect().top()))
        .unwrap()
        .accesskit_node()
        .label()
        .unwrap()
}

#[test]
fn the_palette_finds_and_runs_commands() {
    let Some(mut editor) = start(|_| None) else { return };
    find(&mut editor, "abo");
    assert_eq!(first_found(&editor), "About Normend");
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(about_is_open(&editor));
    assert!(!editor.shows("Find a command"));
    editor.key(Modifiers::NONE, Key::Escape);
    // What was chosen lately comes first, and is remembered.
    editor.key(Modifiers::COMMAND, Key::P);
    assert_eq!(first_found(&editor), "About Normend");
    assert_eq!(kept(&editor).recent_commands, [Command::About.name()]);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Find a command"));
    // What cannot be done says why, and stays.
    find(&mut editor, "undo");
    assert_eq!(first_found(&editor), "Undo: there is nothing to undo");
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.shows("Undo: there is nothing to undo"));
    editor.key(Modifiers::NONE, Key::Escape);
}

#[test]
fn the_palette_goes_by_arrows_and_opens_scans_and_modes() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let before = editor.picture();
    find(&mut editor, "display:");
    let second = {
        let mut rows: Vec<_> = editor.harness.query_all_by_role(Role::ListBoxOption).collect();
        rows.sort_by(|a, b| a.rect().top().total_cmp(&b.rect().top()));
        rows[1].accesskit_node().label().unwrap()
    };
    assert!(second.starts_with("Display: "), "{second}");
    editor.key(Modifiers::NONE, Key::ArrowDown);
    editor.key(Modifiers::NONE, Key::Enter);
    editor.harness.run_steps(10);
    assert!(editor.picture().rgba != before.rgba);
    find(&mut editor, "sphere.ply");
    assert_eq!(first_found(&editor), "Open sphere.ply");
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.app().is_busy(), "the scan is opened again");
    editor.wait_until_oriented();
}

/// Lets more than a minute pass, after which the next hint may come.
fn wait_for_a_hint(editor: &mut Editor) {
    let now = editor.harness.ctx.input(|input| input.time);
    editor.harness.input_mut().time = Some(now + 61.0);
    editor.harness.step();
    editor.harness.input_mut().time = None;
    editor.harness.run_steps(2);
}

#[test]
fn hints_come_one_by_one_and_never_again() {
    let prepare = |settings: &mut Settings| settings.dismissed_hints.clear();
    let Some(mut editor) = start_prepared(1.0, prepare, sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(editor.shows("Look around"));
    editor.click_button("Got it");
    assert!(!editor.shows("Got it"), "not the next at once");
    wait_for_a_hint(&mut editor);
    assert!(editor.shows("Mend with a click") && !editor.shows("Look around"));
    assert!(kept(&editor).dismissed_hints.contains(Card::Look.name()));
    // Who mends needs no hint how.
    editor.mend();
    assert!(!editor.shows("Mend with a click"));
    wait_for_a_hint(&mut editor);
    assert!(editor.shows("finds every command"));
    editor.click_button("Got it");
    assert!(!editor.shows("finds every command"));
    // They come again when they are asked for.
    find(&mut editor, "hints again");
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.shows("Look around"));
    assert!(kept(&editor).dismissed_hints.is_empty());
    // As high as their words and the button.
    let title = editor.harness.get_by_label("Look around").rect();
    let button = editor.harness.get_by_role_and_label(Role::Button, "Got it").rect();
    assert!(button.bottom() - title.top() < 160.0, "{title:?} to {button:?}");
    // And not at all when they are off.
    editor.key(Modifiers::COMMAND, Key::Comma);
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Show hints")
        .click();
    editor.harness.run_steps(2);
    assert!(!editor.shows("Got it"));
    assert!(!kept(&editor).shows_hints);
}

#[test]
fn messages_are_filtered_copied_and_cleared() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.key(Modifiers::COMMAND, Key::Y);
    assert!(editor.said("Redo: there is nothing to redo."));
    editor.key(Modifiers::NONE, Key::F2);
    editor.harness.run_steps(3);
    assert!(editor.shows("Kept the given normals") && editor.shows("Redo: there is nothing to redo."));
    editor.click_button("Notes");
    assert!(!editor.shows("Kept the given normals") && editor.shows("Redo: there is nothing to redo."));
    editor.harness.get_by_role_and_label(Role::Button, "Copy").click();
    let copied: Vec<String> = (0..3)
        .flat_map(|_| {
            editor.harness.step();
            let commands = &editor.harness.output().platform_output.commands;
            let texts = commands.iter().filter_map(|command| match command {
                egui::OutputCommand::CopyText(text) => Some(text.clone()),
                _ => None,
            });
            texts.collect::<Vec<_>>()
        })
        .collect();
    assert_eq!(copied.len(), 1);
    assert!(
        copied[0].ends_with("  Note  Redo: there is nothing to redo.\n"),
        "{copied:?}"
    );
    assert!(!copied[0].contains("Kept the given normals"));
    editor.click_button("Clear");
    assert!(editor.shows("Nothing was said yet") && editor.app().messages().entries().is_empty());
}

#[test]
fn the_interface_is_scaled_in_steps() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let scale = |editor: &Editor| editor.harness.ctx.zoom_factor();
    for _ in 0..2 {
        editor.key(Modifiers::COMMAND, Key::Equals);
    }
    assert_eq!(scale(&editor), 1.25);
    assert_eq!(kept(&editor).ui_scale, 1.25);
    editor.key(Modifiers::COMMAND, Key::Minus);
    assert_eq!(scale(&editor), 1.1);
    editor.key(Modifiers::COMMAND, Key::Num0);
    assert_eq!(scale(&editor), 1.0);
    // Without Ctrl the same keys are for splats.
    let before = editor.picture();
    editor.key(Modifiers::NONE, Key::Plus);
    editor.harness.run_steps(10);
    assert!(editor.picture().rgba != before.rgba);
    assert_eq!(scale(&editor), 1.0);
}

#[test]
fn the_status_bar_says_how_the_tool_is_used() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(editor.shows("Click  Mend here"));
}

#[test]
fn every_window_has_names_for_its_widgets_in_both_themes() {
    for theme in [ThemeChoice::Dark, ThemeChoice::Light] {
        let prepare = |settings: &mut Settings| {
            settings.theme = theme;
            settings.dismissed_hints.clear();
        };
        let Some(mut editor) = start_prepared(1.0, prepare, sphere_with_wrong_cap) else {
            return;
        };
        editor.wait_until_oriented();
        let name = theme.label().to_lowercase();
        check(&mut editor, &format!("editor-{name}"));
        for (modifiers, key, what) in [
            (Modifiers::NONE, Key::F1, "sheet"),
            (Modifiers::NONE, Key::F2, "messages"),
            (Modifiers::COMMAND, Key::P, "palette"),
            (Modifiers::COMMAND, Key::E, "export"),
            (Modifiers::COMMAND | Modifiers::SHIFT, Key::O, "path"),
            (Modifiers::COMMAND, Key::Comma, "preferences"),
        ] {
            editor.key(modifiers, key);
            check(&mut editor, &format!("{what}-{name}"));
            if key == Key::Comma {
                editor.click_button("Keys");
                let label = "Search a command or a key";
                editor.harness.get_by_role_and_label(Role::TextInput, label).focus();
                editor.harness.run_steps(2);
                let field = editor.harness.get_by_role_and_label(Role::TextInput, label);
                field.type_text("ctrl+z");
                editor.harness.run_steps(3);
                editor.click_button("Add a key to Undo");
                editor.key(Modifiers::COMMAND, Key::E);
                assert!(editor.shows("Ctrl+E is the key of “Export…”"));
                check(&mut editor, &format!("keys-{name}"));
            }
            editor.key(Modifiers::NONE, Key::Escape);
        }
    }
}

/// Everything that can be shown about a scan: sources, a pin, a selection, suspects, steps to undo and to redo.
fn fill(editor: &mut Editor) {
    editor.mend();
    editor.key(Modifiers::NONE, Key::N);
    editor.wait("the suspects", |app| app.suspects().unwrap().is_known());
    editor.harness.state_mut().act(Command::SelectAll.into());
    editor.wait("a selection", |app| !app.is_selecting());
    editor.key(Modifiers::NONE, Key::P);
    editor.harness.state_mut().act(Command::SelectNone.into());
    editor.key(Modifiers::COMMAND, Key::Z);
    let document = editor.app().document().unwrap();
    assert!(!document.selected().is_empty() && document.next_redo().is_some() && document.n_done() > 1);
}

#[test]
fn every_tab_and_window_has_names_at_any_width_of_the_panel() {
    let widths = [
        *theme::SIDE_PANEL_WIDTHS.start(),
        theme::SIDE_PANEL_WIDTH,
        *theme::SIDE_PANEL_WIDTHS.end(),
    ];
    for width in widths {
        let prepare = |settings: &mut Settings| settings.side_width = width;
        let Some(mut editor) = start_prepared(1.0, prepare, sphere_with_wrong_cap) else {
            return;
        };
        editor.harness.set_size(Vec2::new(1200.0, 1100.0));
        editor.wait_until_oriented();
        fill(&mut editor);
        for tab in SideTab::ALL {
            editor.open_tab(tab);
            check(&mut editor, &format!("{}-{width}", tab.label().to_lowercase()));
            stays_inside(&editor, width);
        }
        // With all rows that the methods have.
        editor.open_tab(SideTab::Orient);
        editor.click_button("Estimate");
        for preset in Preset::ALL {
            editor.choose("Preset", preset.label());
            check(&mut editor, &format!("orient-{}-{width}", preset.name()));
            stays_inside(&editor, width);
        }
    }
}

/// Checks that no widget of the side panel reaches past the window's right edge, and that its tabs are in one row and end
/// where the content does.
fn stays_inside(editor: &Editor, width: f32) {
    let right = editor.harness.ctx.content_rect().right();
    let inside = right - theme::SPACE_M;
    let left = right - width;
    let nodes = editor
        .harness
        .query_all(egui_kittest::kittest::by().predicate(|_| true));
    let buttons = [
        Role::Button,
        Role::ComboBox,
        Role::Slider,
        Role::SpinButton,
        Role::TextInput,
    ];
    for node in nodes.filter(|node| buttons.contains(&node.accesskit_node().role())) {
        let rect = node.rect();
        if rect.left() >= left {
            let label = node.accesskit_node().label();
            assert!(rect.right() <= inside + 0.5, "{label:?} at {rect:?}, inside {inside}");
        }
    }
    let tabs = SideTab::ALL.map(|tab| {
        let tabs = editor.harness.query_all_by_role_and_label(Role::Button, tab.label());
        tabs.last().unwrap().rect()
    });
    assert!(tabs.iter().all(|tab| tab.top() == tabs[0].top()), "{tabs:?}");
    assert!((tabs[0].left() - left - theme::SPACE_M).abs() <= 1.0, "{tabs:?}");
    let end = inside - theme::SCROLL_WIDTH;
    assert!((tabs[4].right() - end).abs() <= 1.0, "{tabs:?} end at {end}");
}

#[test]
fn every_other_window_has_names() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let scan = editor.folder.path().join("sphere.ply");
    fill(&mut editor);
    for command in [
        Command::Screenshot,
        Command::Turntable,
        Command::OpenRecipePath,
        Command::OpenReferencePath,
        Command::OpenPath,
        Command::Export,
        Command::Palette,
        Command::About,
        Command::Preferences,
        Command::Log,
        Command::Shortcuts,
    ] {
        editor.harness.state_mut().act(command.into());
        check(&mut editor, command.name());
        editor.key(Modifiers::NONE, Key::Escape);
    }
    editor.harness.state_mut().act(Command::WhatISeeFacesMe.into());
    editor.wait("a proposal", |app| app.n_proposed().is_some() || !app.is_selecting());
    check(&mut editor, "proposal");
    editor.key(Modifiers::NONE, Key::Escape);
    editor.close();
    editor.harness.run_steps(3);
    assert!(editor.shows("Keep for next time"));
    check(&mut editor, "unsaved");
    editor.key(Modifiers::NONE, Key::Escape);
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Decide later"));
    check(&mut editor, "restore");
}

#[test]
fn the_side_panel_is_as_wide_as_it_is_dragged() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let edge = |editor: &Editor| editor.app().view_rect().right();
    let before = edge(&editor);
    let place = egui::pos2(before + 3.0, 300.0);
    for x in [0.0, -20.0, -60.0] {
        let pointer = place + egui::vec2(x, 0.0);
        if x == 0.0 {
            editor.harness.drag_at(pointer);
        } else {
            editor.harness.hover_at(pointer);
        }
        editor.harness.run_steps(3);
    }
    editor.harness.drop_at(place - egui::vec2(60.0, 0.0));
    editor.harness.run_steps(4);
    assert_eq!(edge(&editor), before - 60.0);
    assert_eq!(kept(&editor).side_width, theme::SIDE_PANEL_WIDTH + 60.0);
    // By keyboard, to the ends and no farther.
    let slider = |editor: &Editor| {
        let edge = editor
            .harness
            .get_by_role_and_label(Role::Slider, "Width of the side panel");
        edge.focus();
    };
    slider(&editor);
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::ArrowLeft);
    assert_eq!(kept(&editor).side_width, theme::SIDE_PANEL_WIDTH + 76.0);
    for _ in 0..20 {
        editor.key(Modifiers::NONE, Key::ArrowRight);
    }
    assert!(editor.is_focused(Role::Slider, "Width of the side panel"));
    assert_eq!(kept(&editor).side_width, *theme::SIDE_PANEL_WIDTHS.start());
    for _ in 0..40 {
        editor.key(Modifiers::NONE, Key::ArrowLeft);
    }
    assert_eq!(kept(&editor).side_width, *theme::SIDE_PANEL_WIDTHS.end());
}

#[test]
fn further_hints_come_at_their_moment() {
    let prepare = |settings: &mut Settings| {
        settings.dismissed_hints = ["look", "point", "size", "find"].map(str::to_owned).into()
    };
    let Some(mut editor) = start_prepared(1.0, prepare, sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(!editor.shows("Got it"));
    editor.key(Modifiers::NONE, Key::L);
    assert!(editor.shows("Choose points by hand"));
    editor.click_button("Got it");
    assert!(!editor.shows("Got it"));
    editor.key(Modifiers::NONE, Key::M);
    editor.open_tab(SideTab::Suspects);
    editor.wait("the suspects", |app| app.suspects().unwrap().is_known());
    editor.harness.run_steps(4);
    wait_for_a_hint(&mut editor);
    assert!(editor.shows("From suspect to suspect"));
    editor.click_button("Got it");
    for _ in 0..2 {
        editor.harness.state_mut().act(Command::SelectAll.into());
        editor.harness.run_steps(4);
        editor.harness.state_mut().act(Command::SelectNone.into());
        editor.harness.run_steps(4);
    }
    wait_for_a_hint(&mut editor);
    assert!(editor.shows("Nothing gets lost"), "edits are journaled");
    editor.click_button("Got it");
    wait_for_a_hint(&mut editor);
    assert!(editor.shows("Back and forth"));
}

/// Checks that every widget has a name. `NORMEND_PICTURES` names a folder that gets a picture to look at.
fn check(editor: &mut Editor, name: &str) {
    editor.harness.run_steps(4);
    editor.harness.check_accessibility();
    if let Some(folder) = std::env::var_os("NORMEND_PICTURES") {
        let picture = editor.harness.render().unwrap();
        picture
            .save(std::path::Path::new(&folder).join(format!("{name}.png")))
            .unwrap();
    }
}

#[test]
fn long_menus_scroll_within_a_small_window() {
    for size in [Vec2::new(1280.0, 800.0), Vec2::new(600.0, 400.0)] {
        let Some(mut editor) = start(|_| None) else { return };
        editor.harness.set_size(size);
        editor.harness.run_steps(3);
        for (menu, first, last) in [
            ("View", "Frame", "Usual interface size"),
            ("Mend", "Mend tool", "Propagate"),
        ] {
            let bar = editor.harness.get_by_role_and_label(Role::Button, menu).rect();
            editor.click_button(menu);
            editor.harness.run_steps(3);
            let place = |editor: &Editor, label: &str| {
                let entries = editor.harness.query_all_by_role(Role::Button);
                let entry = entries.rev().find(|entry| {
                    // The key follows the name.
                    entry.accesskit_node().label().is_some_and(|of| of.starts_with(label))
                });
                entry.unwrap_or_else(|| panic!("no {label}")).rect()
            };
            assert!(
                place(&editor, first).top() >= bar.bottom(),
                "{menu} covers the bar in {size}"
            );
            if let Some(folder) = std::env::var_os("NORMEND_PICTURES") {
                let image = editor.harness.render().unwrap();
                let name = format!("menu-{menu}-{}.png", size.x);
                image.save(std::path::Path::new(&folder).join(name)).unwrap();
            }
            // By wheel the last entry comes into the window.
            editor.hover(place(&editor, first).center());
            for _ in 0..40 {
                editor.harness.event(egui::Event::MouseWheel {
                    unit: egui::MouseWheelUnit::Point,
                    delta: Vec2::new(0.0, -100.0),
                    phase: egui::TouchPhase::Move,
                    source: egui::MouseWheelSource::Unknown,
                    modifiers: Modifiers::NONE,
                });
                editor.harness.run_steps(1);
            }
            editor.harness.run_steps(20);
            let end = place(&editor, last);
            assert!(
                end.bottom() <= size.y && end.top() >= bar.bottom(),
                "{menu} in {size}: {end:?}"
            );
            editor.key(Modifiers::NONE, Key::Escape);
            editor.harness.run_steps(2);
        }
    }
}
