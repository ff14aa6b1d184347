//! Text with a point a line. The last byte chooses the extension, because detection goes by it too.

#![no_main]

const NAMES: [&str; 5] = ["a.xyz", "a.csv", "a.pts", "a.txt", "a"];

libfuzzer_sys::fuzz_target!(init: normend_fuzz::limits::begin(), |bytes: &[u8]| {
    let name = bytes.last().map_or(0, |&byte| usize::from(byte) % NAMES.len());
    normend_fuzz::scans::check(bytes, NAMES[name]);
});
