//! What the targets do with their input: read it as the program does, write what was read, read that again, and compare.
//!
//! Whatever comes in, nothing panics, takes more memory than [`limits`] allows, or comes back as something else than was
//! written. Time is limited by libFuzzer. Each target is one line in `fuzz_targets/` that calls one function from here.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod limits;

pub mod recipes;

pub mod scans;

#[cfg(feature = "editor")]
pub mod settings;
