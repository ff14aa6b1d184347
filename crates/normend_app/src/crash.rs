//! When the editor has to stop: a report for those who mend the program, and the way back for the user.
//!
//! What a report says is kept here as it happens, since a panic has no time to ask. The only state that is not the
//! editor's own, because a panic hook belongs to the process.

use std::backtrace::Backtrace;
use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::folders;
use crate::work::ScanOrigin;

/// Messages that a report repeats.
const N_MESSAGES: usize = 20;
/// Reports that are kept; older ones are removed.
const N_REPORTS: usize = 10;
/// Set for an editor that came up again by itself.
const RESTARTED_VARIABLE: &str = "NORMEND_RESTARTED";
/// Set for an editor that came up again by itself and had the scan that comes with the program open.
const SAMPLE_VARIABLE: &str = "NORMEND_RESTARTED_SAMPLE";
/// [`RESTARTED_VARIABLE`] where edits are lost.
const LOST: &str = "lost";
/// Asks for a loss of the graphics device, see [`is_loss_asked_for`].
const LOSE_VARIABLE: &str = "NORMEND_LOSE_DEVICE";
/// Asks for a panic, see [`is_panic_asked_for`] and [`is_work_panic_asked_for`].
const PANIC_VARIABLE: &str = "NORMEND_PANIC";
/// An editor that came up again and is lost within this time would be lost again.
const SHORTEST_RUN: Duration = Duration::from_secs(15);

/// What a report says before it names whether edits are kept.
const EDITS_LINE: &str = "Edits: ";

/// What becomes of the edits when the editor stops now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edits {
    /// There are none that no exported file has.
    None,
    /// They are in the journal.
    Kept,
    /// The journal cannot be written.
    Lost,
}

impl Edits {
    const ALL: [Self; 3] = [Self::None, Self::Kept, Self::Lost];

    /// In a report.
    fn words(self) -> &'static str {
        match self {
            Self::None => "none that are not exported",
            Self::Kept => "kept in the journal",
            Self::Lost => "not kept, the journal cannot be written",
        }
    }
}

/// What a panic ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// The editor.
    Editor,
    /// Work beside the window, which the editor outlives.
    Work,
}

impl Ends {
    /// What the names of its reports begin with.
    fn prefix(self) -> &'static str {
        match self {
            Self::Editor => "crash-",
            Self::Work => "work-",
        }
    }
}

/// A report that the user was not told of yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct News {
    /// The file's name.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    /// What became of the edits; `None` when the report does not say.
    pub(crate) edits: Option<Edits>,
}

/// What is known of the run.
#[derive(Debug)]
struct Run {
    adapter: String,
    messages: VecDeque<String>,
    /// The scan that is open.
    scan: Option<ScanOrigin>,
    /// When the window came up; before that a panic is a missing library, which is said in words.
    started: Option<Instant>,
    /// The graphics device is gone, and why.
    lost: Option<String>,
    edits: Edits,
    /// The report of work that panicked, until the user is told of it.
    of_work: Option<PathBuf>,
}

static RUN: Mutex<Run> = Mutex::new(Run {
    adapter: String::new(),
    messages: VecDeque::new(),
    scan: None,
    started: None,
    lost: None,
    edits: Edits::None,
    of_work: None,
});

fn run() -> MutexGuard<'static, Run> {
    RUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps a message for a report.
pub(crate) fn remember(message: &str) {
    let mut run = run();
    if run.messages.len() == N_MESSAGES {
        run.messages.pop_front();
    }
    run.messages.push_back(message.to_owned());
}

/// The window has come up, on this adapter.
pub(crate) fn start(adapter: &str) {
    let mut run = run();
    adapter.clone_into(&mut run.adapter);
    run.started = Some(Instant::now());
}

/// Keeps which scan is open, for [`restart`].
pub(crate) fn set_scan(scan: ScanOrigin) {
    run().scan = Some(scan);
}

/// Keeps what becomes of the edits when the editor stops now.
pub(crate) fn set_edits(edits: Edits) {
    run().edits = edits;
}

/// The graphics device is gone; `reason` is what the driver says.
pub(crate) fn set_lost(reason: &str) {
    run().lost = Some(reason.to_owned());
}

/// Why the graphics device is gone, if it is.
pub(crate) fn lost() -> Option<String> {
    run().lost.clone()
}

/// Whether a panic is that of egui or wgpu on a lost device, which they do not survive.
pub(crate) fn is_loss(panic: &str) -> bool {
    // The words of egui-wgpu 0.37, `renderer.rs`, and of wgpu 29, `Device is lost`.
    let words = ["Failed to create staging buffer", "evice is lost", "evice lost"];
    lost().is_some() || words.iter().any(|words| panic.contains(words))
}

/// What the editor's thread unwinds with when the graphics device is lost: nothing can be drawn any more.
#[derive(Debug)]
pub(crate) struct DeviceLost {
    pub(crate) restarted: Result<(), String>,
}

/// Leaves a window whose graphics device is lost, after the program was started again. Unwinds to `run`.
pub(crate) fn leave_lost() -> ! {
    std::panic::resume_unwind(Box::new(DeviceLost { restarted: restart() }))
}

/// Whether this editor shall panic when its window comes up: so reports can be tried out.
pub(crate) fn is_panic_asked_for() -> bool {
    std::env::var_os(PANIC_VARIABLE).is_some_and(|wanted| wanted != "work")
}

/// Whether all work beside the window shall panic.
pub(crate) fn is_work_panic_asked_for() -> bool {
    std::env::var_os(PANIC_VARIABLE).is_some_and(|wanted| wanted == "work")
}

/// Whether this editor shall lose its graphics device once it shows a scan: so the way back can be tried out.
pub(crate) fn is_loss_asked_for() -> bool {
    std::env::var_os(LOSE_VARIABLE).is_some() && !was_restarted()
}

/// Whether this editor came up again by itself after the graphics device was lost, so that its edits are restored
/// without asking.
pub fn was_restarted() -> bool {
    std::env::var_os(RESTARTED_VARIABLE).is_some()
}

/// Starts the program once more with the scan that is open. This process should end.
///
/// # Errors
/// In words: the program cannot be started, or it was lost at once after it had come up again.
pub(crate) fn restart() -> Result<(), String> {
    let run = run();
    let is_too_soon = run.started.is_none_or(|started| started.elapsed() < SHORTEST_RUN);
    if was_restarted() && is_too_soon {
        return Err("it was lost again at once, so the graphics driver needs a look".to_owned());
    }
    let started = std::env::current_exe().and_then(|program| successor(&program, &run).spawn());
    started
        .map(drop)
        .map_err(|error| format!("it cannot be started again: {}", normend_io::io_words(&error)))
}

/// What starts `program` as the one that goes on with the scan of `run` and restores without asking.
fn successor(program: &Path, run: &Run) -> Command {
    let mut command = Command::new(program);
    command.env_remove(SAMPLE_VARIABLE);
    match &run.scan {
        Some(ScanOrigin::File(path)) => drop(command.arg("--").arg(path)),
        Some(ScanOrigin::Files(paths)) => drop(command.arg("--").args(paths)),
        Some(ScanOrigin::Sample) => drop(command.env(SAMPLE_VARIABLE, "1")),
        None => {}
    }
    command.env(RESTARTED_VARIABLE, if run.edits == Edits::Lost { LOST } else { "1" });
    command
}

/// Whether this editor came up again by itself and edits of the one before it are lost.
pub(crate) fn has_lost_edits() -> bool {
    std::env::var_os(RESTARTED_VARIABLE).is_some_and(|value| value == LOST)
}

/// Whether this editor came up again by itself and shall open the scan that comes with the program.
pub(crate) fn reopens_sample() -> bool {
    was_restarted() && std::env::var_os(SAMPLE_VARIABLE).is_some()
}

/// Writes a report of a panic while the window is up. `None` when there is nothing to write it for, or nowhere.
pub(crate) fn report(panic: &str, ends: Ends) -> Option<PathBuf> {
    // A panic while this very state is held must not wait for itself.
    let mut run = RUN.try_lock().ok()?;
    run.started?;
    let folder = folders::state_folder()?;
    let file = write_report(&folder, &run, panic, ends, &jiff::Zoned::now()).ok()?;
    if ends == Ends::Work {
        run.of_work = Some(file.clone());
    }
    Some(file)
}

/// The report of work that panicked, once.
pub(crate) fn take_report_of_work() -> Option<PathBuf> {
    run().of_work.take()
}

fn write_report(folder: &Path, run: &Run, panic: &str, ends: Ends, now: &jiff::Zoned) -> io::Result<PathBuf> {
    fs::create_dir_all(folder)?;
    let file = folder.join(format!("{}{}.txt", ends.prefix(), now.strftime("%Y-%m-%d-%H%M%S")));
    let what = match ends {
        Ends::Editor => "closed unexpectedly",
        Ends::Work => "had to stop some work",
    };
    let secs = run.started.map_or(0, |started| started.elapsed().as_secs());
    let mut text = format!(
        "Normend {} {what}.\n\nTime: {}\nSystem: {} ({})\nGraphics: {}\nRan for: {secs} s\n{EDITS_LINE}{}\n",
        env!("CARGO_PKG_VERSION"),
        now.strftime("%Y-%m-%d %H:%M:%S %:z"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        run.adapter,
        run.edits.words(),
    );
    if let Some(reason) = &run.lost {
        text += &format!("Graphics device lost: {reason}\n");
    }
    text += &format!("\n{panic}\n\nLast messages:\n");
    for message in &run.messages {
        text += &format!("- {message}\n");
    }
    text += &format!("\nBacktrace:\n{}\n", Backtrace::force_capture());
    // Into its place at once: nothing stands there that could be lost, and whoever crashes does as little as possible.
    fs::write(&file, without_home(text))?;
    for old in reports(folder, ends).into_iter().rev().skip(N_REPORTS) {
        // It is only one too many; the next report tries again.
        let _ = fs::remove_file(folder.join(old));
    }
    Ok(file)
}

/// Paths inside the home folder do not tell whose it is.
fn without_home(text: String) -> String {
    match directories::BaseDirs::new() {
        Some(folders) if folders.home_dir().components().count() > 1 => {
            text.replace(&*folders.home_dir().to_string_lossy(), "~")
        }
        _ => text,
    }
}

/// The names of the reports of one kind in `folder`, oldest first.
fn reports(folder: &Path, of: Ends) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.starts_with(of.prefix()) && name.ends_with(".txt"))
        .collect();
    // Their names are dates.
    names.sort();
    names
}

/// The newest report of a crash, unless it is `told` or older.
pub(crate) fn news(told: &str) -> Option<News> {
    let folder = folders::state_folder()?;
    news_in(&folder, told)
}

fn news_in(folder: &Path, told: &str) -> Option<News> {
    let name = reports(folder, Ends::Editor)
        .pop()
        .filter(|name| name.as_str() > told)?;
    let path = folder.join(&name);
    let text = fs::read_to_string(&path).unwrap_or_default();
    let words = text.lines().find_map(|line| line.strip_prefix(EDITS_LINE));
    let edits = Edits::ALL.into_iter().find(|edits| words == Some(edits.words()));
    Some(News { name, path, edits })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn a_run() -> Run {
        Run {
            adapter: "Test adapter (Vulkan)".to_owned(),
            messages: VecDeque::from(["Opened church.ply.".to_owned()]),
            scan: None,
            started: Some(Instant::now()),
            lost: Some("destroyed".to_owned()),
            edits: Edits::Kept,
            of_work: None,
        }
    }

    #[test]
    fn a_report_says_what_is_needed_and_is_told_once() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(news_in(folder.path(), ""), None);
        let now: jiff::Zoned = "2026-11-22T14:03:59+01:00[Europe/Berlin]".parse().unwrap();
        let file = {
            let panic = "panicked at src/x.rs:1:1:\nno luck";
            write_report(folder.path(), &a_run(), panic, Ends::Editor, &now).unwrap()
        };
        let text = fs::read_to_string(&file).unwrap();
        for part in [
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            "Test adapter (Vulkan)",
            "no luck",
            "- Opened church.ply.",
            "lost: destroyed",
            "2026-11-22 14:03:59",
            "Backtrace:",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let news = news_in(folder.path(), "").unwrap();
        assert_eq!((news.name.as_str(), &news.path), ("crash-2026-11-22-140359.txt", &file));
        assert_eq!(news.edits, Some(Edits::Kept));
        assert_eq!(news_in(folder.path(), &news.name), None);
    }

    #[test]
    fn the_next_editor_hears_what_became_of_the_edits_but_not_of_work() {
        let folder = tempfile::tempdir().unwrap();
        let now: jiff::Zoned = "2026-11-22T14:03:59+01:00[Europe/Berlin]".parse().unwrap();
        let file = write_report(folder.path(), &a_run(), "no luck", Ends::Work, &now).unwrap();
        let text = fs::read_to_string(file).unwrap();
        assert!(
            text.contains("had to stop some work") && !text.contains("closed"),
            "{text}"
        );
        assert_eq!(news_in(folder.path(), ""), None, "the editor went on");
        for edits in Edits::ALL {
            let run = Run { edits, ..a_run() };
            write_report(folder.path(), &run, "", Ends::Editor, &now).unwrap();
            assert_eq!(news_in(folder.path(), "").unwrap().edits, Some(edits));
        }
        fs::write(folder.path().join("crash-2026-11-22-140359.txt"), "of an older editor").unwrap();
        assert_eq!(news_in(folder.path(), "").unwrap().edits, None);
    }

    #[test]
    fn the_editor_that_comes_up_again_gets_the_scan_and_hears_of_what_is_lost() {
        let check = |scan: Option<ScanOrigin>, edits: Edits| {
            let command = successor(Path::new("normend"), &Run { scan, edits, ..a_run() });
            let arguments: Vec<String> = (command.get_args())
                .map(|argument| argument.to_string_lossy().into_owned())
                .collect();
            let value = |name: &str| {
                let set = command.get_envs().find(|(key, _)| *key == name);
                set.and_then(|(_, value)| Some(value?.to_string_lossy().into_owned()))
            };
            (arguments.join(" "), value(RESTARTED_VARIABLE), value(SAMPLE_VARIABLE))
        };
        let words = |words: &str| Some(words.to_owned());
        let files = ScanOrigin::Files(vec!["a.ply".into(), "b.ply".into()]);
        assert_eq!(check(Some(files), Edits::Kept).0, "-- a.ply b.ply");
        let file = ScanOrigin::File("-a.ply".into());
        assert_eq!(
            check(Some(file), Edits::Kept),
            ("-- -a.ply".to_owned(), words("1"), None)
        );
        assert_eq!(
            check(Some(ScanOrigin::Sample), Edits::Lost),
            (String::new(), words(LOST), words("1"))
        );
        assert_eq!(check(None, Edits::None), (String::new(), words("1"), None));
    }

    #[test]
    fn only_the_last_reports_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let first: jiff::Zoned = "2026-01-01T00:00:00+00:00[UTC]".parse().unwrap();
        for minute in 0..(N_REPORTS as i64 + 3) {
            let now = &first + jiff::SignedDuration::from_mins(minute);
            write_report(folder.path(), &a_run(), "", Ends::Editor, &now).unwrap();
        }
        let names = reports(folder.path(), Ends::Editor);
        assert_eq!(names.len(), N_REPORTS);
        assert_eq!(names[0], "crash-2026-01-01-000300.txt");
    }

    #[test]
    fn the_home_folder_is_not_named() {
        let home = directories::BaseDirs::new().unwrap().home_dir().display().to_string();
        assert_eq!(without_home(format!("at {home}/scans/a.ply")), "at ~/scans/a.ply");
    }
}
