//! The `normend` program: the editor, and the same engine on the command line.
//!
//! Two steps: [`arguments`] is what was typed, [`commands`] is what it means. Results go to standard output or to
//! files; bars and words go to standard error. The exit code is 0 when all was done, 1 when something failed, 2 for
//! wrong use, and 130 when Ctrl-C stopped the work.
//!
//! Not here: geometry, file formats, drawing. Each command is a few calls into the crates that know.

mod arguments;
mod commands;
mod console;
mod memory;

use std::io::{self, IsTerminal};
use std::path::Path;
use std::process::ExitCode;

use tracing_subscriber::EnvFilter;

use arguments::{Arguments, Command};
use commands::{Outcome, WrongUse, bench, check, convert, generate, orient, render, replay, suspects, wrong_use};

/// The exit code of a program that was interrupted, by the shells' convention: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let arguments = Arguments::of_program();
    start_log();
    let name = arguments.command.as_ref().map(Command::name);
    match run(arguments) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Failed) => ExitCode::FAILURE,
        Err(error) => exit_code_of(&error, name),
    }
}

fn run(arguments: Arguments) -> anyhow::Result<Outcome> {
    match arguments.command {
        None => {
            if let Some(scan) = arguments.scans.first()
                && is_mistyped_command(scan)
            {
                return Err(wrong_use(format!(
                    "there is no file and no command of the name '{}'",
                    scan.display()
                )));
            }
            normend_app::run(arguments.scans, arguments.restore)?;
            Ok(Outcome::Done)
        }
        Some(Command::Orient(arguments)) => orient::run(arguments),
        Some(Command::Check(arguments)) => check::run(&arguments),
        Some(Command::Convert(arguments)) => convert::run(&arguments),
        Some(Command::Suspects(arguments)) => suspects::run(&arguments),
        Some(Command::Render(arguments)) => render::run(&arguments),
        Some(Command::Generate(arguments)) => generate::run(&arguments),
        Some(Command::Replay(arguments)) => replay::run(&arguments),
        Some(Command::Rehearse(arguments)) => replay::rehearse(&arguments),
        Some(Command::Bench(arguments)) => bench::run(&arguments),
    }
}

/// Whether a scan that does not exist looks like a command: one word without an extension.
fn is_mistyped_command(scan: &Path) -> bool {
    scan.extension().is_none() && scan.components().count() == 1 && !scan.exists()
}

/// Says what went wrong, once, and gives the exit code for it; `name` is the command's.
fn exit_code_of(error: &anyhow::Error, name: Option<&str>) -> ExitCode {
    if let Some(wrong_use) = error.downcast_ref::<WrongUse>() {
        arguments::usage_error(name, wrong_use).exit();
    }
    // The reader of our output closed it (`normend check … | head -1`): it has what it wanted.
    let is_broken_pipe = |cause: &(dyn std::error::Error + 'static)| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    };
    if error.chain().any(is_broken_pipe) {
        return ExitCode::SUCCESS;
    }
    if console::is_stopped() {
        console::say("stopped; files that were not finished are as they were");
        return ExitCode::from(INTERRUPTED);
    }
    console::say(&format!("error: {}", console::in_words(error)));
    ExitCode::FAILURE
}

/// Diagnostics for developers on standard error, chosen by `RUST_LOG`; by default warnings and errors, and of the window
/// system only errors, because it warns of every display that is not quite usual. In color only on a terminal, and not
/// when `NO_COLOR` is set.
fn start_log() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,winit=error"));
    let is_colored = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(is_colored)
        .without_time()
        .init();
}
