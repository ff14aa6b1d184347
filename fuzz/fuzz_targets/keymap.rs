//! Keys that a user gives to commands.

#![no_main]

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| normend_fuzz::settings::check_keymap(bytes));
