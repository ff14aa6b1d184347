//! Opening the window, and saying in words why that fails.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::anyhow;
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetupCreateNew};
use normend_render::SplatRenderer;

use crate::app::App;
use crate::crash::{self, DeviceLost, Ends};
use crate::settings::{SettingsStore, WindowPlace};
use crate::work::ScanOrigin;

const MIN_SIZE: [f32; 2] = [900.0, 600.0];

/// What the panic hook saw of the first panic of the window's thread.
#[derive(Default)]
struct Seen {
    panic: Option<String>,
    report: Option<PathBuf>,
    /// The graphics device was lost: whether the editor came up again.
    restarted: Option<Result<(), String>>,
}

/// Opens the editor's window, with a scan of these files when there are any, and runs until it is closed. Where `restores`, its newest
/// journal is restored without asking.
///
/// # Errors
/// In words for the user: no display, no graphics driver, and the package that gives it.
pub fn run(scans: Vec<PathBuf>, restores: bool) -> anyhow::Result<()> {
    let (mut settings, problem) = SettingsStore::load();
    let news = crash::news(&settings.settings.told_crash);
    if let Some(news) = &news {
        settings.settings.told_crash.clone_from(&news.name);
    }
    let options = options(settings.settings.window);
    // Missing libraries of the window system are panics of its bindings; they become words like all other errors.
    let seen = Arc::new(Mutex::new(Seen::default()));
    let former_hook = std::panic::take_hook();
    let hook_seen = Arc::clone(&seen);
    std::panic::set_hook(Box::new(move |info| see(&hook_seen, &info.to_string())));
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        eframe::run_native(
            "Normend",
            options,
            Box::new(move |cc| {
                let mut app = App::with_settings(cc, None, settings, problem);
                let sample = crash::reopens_sample().then_some(ScanOrigin::Sample);
                if let Some(scan) = ScanOrigin::of_paths(scans).or(sample) {
                    app.open_at_start(scan, restores || crash::was_restarted());
                }
                app.say_what_happened(news);
                Ok(Box::new(app))
            }),
        )
    }));
    std::panic::set_hook(former_hook);
    let panic = match outcome {
        Ok(Ok(())) => return Ok(()),
        Ok(Err(error)) => return Err(anyhow!(in_words(&error.to_string()))),
        Err(panic) => panic,
    };
    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    // The editor leaves by itself when it hears of the loss, else egui stops at it.
    let restarted = match panic.downcast::<DeviceLost>() {
        Ok(lost) => Some(lost.restarted),
        Err(_) => seen.restarted.take(),
    };
    match restarted {
        Some(Ok(())) => {
            tracing::warn!("the graphics device was lost; the editor starts again with the open scan");
            Ok(())
        }
        Some(Err(reason)) => Err(anyhow!(
            "The graphics device was lost and the editor had to stop; {reason}. Open the scan again."
        )),
        None => {
            let panic = seen.panic.take();
            let mut words = in_words(&panic.unwrap_or_else(|| "no reason given".to_owned()));
            if let Some(report) = &seen.report {
                words += &format!("\nA report is at {}", report.display());
            }
            Err(anyhow!(words))
        }
    }
}

/// What the panic hook does: jobs turn their own panics into messages and get a report, the window's thread is done for.
fn see(seen: &Mutex<Seen>, panic: &str) {
    tracing::error!("{panic}");
    if std::thread::current().name() != Some("main") {
        if !crash::is_loss(panic) {
            // Where it lies is said with the job's own message; without a report that says the reason alone.
            let _ = crash::report(panic, Ends::Work);
        }
        return;
    }
    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    if seen.panic.is_some() {
        return;
    }
    seen.panic = Some(panic.to_owned());
    if crash::is_loss(panic) {
        // At once: giving up what belonged to the device may stop the process.
        seen.restarted = Some(crash::restart());
    } else {
        seen.report = crash::report(panic, Ends::Editor);
    }
}

/// The graphics setup of the editor: its device has the adapter's own limits, so that large scans fit.
pub fn graphics_setup() -> WgpuSetupCreateNew {
    WgpuSetupCreateNew {
        device_descriptor: Arc::new(SplatRenderer::device_descriptor),
        ..WgpuSetupCreateNew::without_display_handle()
    }
}

/// Where the window is now, given where it was before this frame.
pub(crate) fn window_place(ctx: &egui::Context, before: WindowPlace) -> WindowPlace {
    // Points shrink with the scale of the interface; the window does not.
    let scale = ctx.zoom_factor();
    ctx.input(|input| {
        let window = input.viewport();
        let maximized = window.maximized.unwrap_or(false);
        let (Some(inner), false) = (window.inner_rect, maximized || window.minimized == Some(true)) else {
            return WindowPlace { maximized, ..before };
        };
        // Only the first screen is sure to be there next time.
        let corner = window.outer_rect.map(|outer| outer.min);
        let is_on_first_screen = |corner: &egui::Pos2| {
            let room = window.monitor_size.unwrap_or_default();
            (0.0..room.x).contains(&corner.x) && (0.0..room.y).contains(&corner.y)
        };
        WindowPlace {
            size: [inner.width() * scale, inner.height() * scale],
            position: corner
                .filter(is_on_first_screen)
                .map(|corner| [corner.x * scale, corner.y * scale]),
            maximized,
        }
    })
}

fn options(place: WindowPlace) -> eframe::NativeOptions {
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("Normend")
        .with_app_id("normend")
        .with_inner_size(place.size)
        .with_min_inner_size(MIN_SIZE)
        .with_maximized(place.maximized)
        .with_icon(icon());
    if let Some(position) = place.position {
        viewport = viewport.with_position(position);
    }
    eframe::NativeOptions {
        viewport,
        renderer: eframe::Renderer::Wgpu,
        wgpu_options: WgpuConfiguration {
            wgpu_setup: graphics_setup().into(),
            ..WgpuConfiguration::default()
        },
        ..eframe::NativeOptions::default()
    }
}

/// A disc, half front and half back.
fn icon() -> egui::IconData {
    const SIDE: u32 = 64;
    let mut rgba = Vec::with_capacity((SIDE * SIDE * 4) as usize);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (dx, dy) = (x as f32 - 31.5, y as f32 - 31.5);
            let coverage = (30.0 - (dx * dx + dy * dy).sqrt()).clamp(0.0, 1.0);
            let [r, g, b] = if dx + dy < 0.0 { [97, 153, 230] } else { [245, 140, 38] };
            rgba.extend([r, g, b, (coverage * 255.0) as u8]);
        }
    }
    egui::IconData {
        rgba,
        width: SIDE,
        height: SIDE,
    }
}

/// What the user can do about an error of the window system or the graphics driver.
fn in_words(error: &str) -> String {
    let has = |words: &[&str]| words.iter().any(|word| error.contains(word));
    if has(&[
        "neither WAYLAND_DISPLAY nor",
        "could not open display",
        "Failed to open connection to X server",
    ]) || has(&["XOpenDisplayFailed", "NoCompositor", "BadDisplay", "wayland compositor"])
    {
        "The editor needs a display, and there is none: DISPLAY and WAYLAND_DISPLAY name no running desktop. \
         Start it from a desktop session; `normend orient` and `normend render` work without a display."
            .to_owned()
    } else if has(&[
        "libxkbcommon",
        "xlib's shared libraries",
        "libX11",
        "libXcursor",
        "libXi",
        "libxcb",
        "libwayland",
    ]) {
        format!(
            "The editor cannot open a window because a library of the desktop is missing ({}). On Debian and Ubuntu: \
             apt install libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon0 libxkbcommon-x11-0 libwayland-client0",
            first_line(error)
        )
    } else if has(&[
        "surface for any enabled backend",
        "No suitable",
        "NoAdapter",
        "adapter",
        "WGPU error",
    ]) {
        // The libraries may add what each driver said, as a dump of their own values.
        let line = first_line(error);
        let reason = line.split_once(": {").map_or(line, |(reason, _)| reason);
        format!(
            "The editor found no graphics driver that it can use ({reason}). On Debian and Ubuntu: \
             apt install libvulkan1 mesa-vulkan-drivers"
        )
    } else {
        format!("The editor had to stop because of an error that it does not know: {error}")
    }
}

fn first_line(text: &str) -> &str {
    text.lines()
        .rev()
        .map(str::trim)
        .find(|line| !line.is_empty())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_remedy() {
        let check = |error, expect: &str| {
            let words = in_words(error);
            assert!(words.contains(expect), "{error}: {words}");
        };
        check(
            "winit EventLoopError: os error: neither WAYLAND_DISPLAY nor WAYLAND_SOCKET nor DISPLAY is set.",
            "needs a display",
        );
        check(
            "panicked at src/x.rs:1:1:\nLibrary libxkbcommon-x11.so could not be loaded.",
            "libxkbcommon-x11-0",
        );
        check("Failed to load one of xlib's shared libraries", "libx11-6");
        check(
            "WGPU error: Failed to create surface for any enabled backend: {}",
            "mesa-vulkan-drivers",
        );
        check(
            "WGPU error: Failed to create surface for any enabled backend: {Vulkan: Hal(())}",
            "use (WGPU error: Failed to create surface for any enabled backend). On",
        );
        check("something else", "something else");
    }
}
