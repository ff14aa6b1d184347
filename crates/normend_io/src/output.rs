//! Where a file is written to.

use std::io::{Read, Seek, Write};
use std::path::Path;

use crate::error::WriteError;

/// A file, or memory in its place: some formats go back to their header at the end, and some read what they wrote.
pub(crate) trait Target: Read + Write + Seek {}

impl<T: Read + Write + Seek> Target for T {}

/// A file that is being written, beside the target that it will replace.
pub(crate) struct Output<'a> {
    /// The target, for messages.
    pub path: &'a Path,
    pub file: &'a mut dyn Target,
}

impl Output<'_> {
    /// Appends `bytes`; who has few at a time gathers them first.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.file.write_all(bytes).map_err(WriteError::io(self.path))
    }
}
