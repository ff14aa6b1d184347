//! Recipes, with right and wrong checksums, and what they do to a cloud.

#![no_main]

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| normend_fuzz::recipes::check(bytes));
