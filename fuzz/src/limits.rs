//! How much memory an input may take: 64 MiB and four times its size.
//!
//! The limit is on what is alive at once, as the program's own allocator counts it, so that libFuzzer's corpus is not part
//! of it. An allocation beyond it fails, which ends the process, and libFuzzer keeps the input.

use std::alloc::System;
use std::path::PathBuf;
use std::sync::OnceLock;

use cap::Cap;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// What any input may take.
const BASE_BYTES: usize = 64 << 20;
/// What it may take besides, as a multiple of its own size.
const SIZE_FACTOR: usize = 4;

/// Prepares the process: the thread that libFuzzer calls is rayon's only one, so that a finding is found again.
pub fn begin() {
    // A pool that is there already is this one.
    let _ = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global();
    folder();
}

/// Runs `check` on an input of `n_bytes` within the limit.
///
/// # Panics
/// When the memory that is alive already is beyond the limit.
pub fn limited(n_bytes: usize, check: impl FnOnce()) {
    let limit = MEMORY.allocated() + BASE_BYTES + SIZE_FACTOR * n_bytes;
    assert!(
        MEMORY.set_limit(limit).is_ok(),
        "more memory is taken than {limit} bytes"
    );
    check();
    // What libFuzzer takes between two inputs is not limited.
    assert!(MEMORY.set_limit(usize::MAX).is_ok());
}

/// A folder for what is written, in memory where the system has such a place. It is emptied by whoever uses it, and stays
/// behind when the process ends by a signal.
pub fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let memory = PathBuf::from("/dev/shm");
        let base = if memory.is_dir() { memory } else { std::env::temp_dir() };
        let folder = base.join(format!("normend-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("no folder for what is written");
        folder
    })
}
