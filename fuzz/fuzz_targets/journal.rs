//! Journals that are cut off or damaged.

#![no_main]

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| normend_fuzz::recipes::check_journal(bytes));
