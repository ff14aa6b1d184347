//! The file of settings.

#![no_main]

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| normend_fuzz::settings::check(bytes));
