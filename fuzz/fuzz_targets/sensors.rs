//! Tables of places that a scan was measured from.

#![no_main]

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| normend_fuzz::recipes::check_sensors(bytes));
