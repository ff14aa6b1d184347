//! [`RenderError`]: what cannot be drawn, in words.

/// What cannot be drawn, in words.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A buffer past the adapter's limits.
    #[error(
        "{what}: {needed} bytes are needed in one buffer, and this graphics adapter allows {limit}; open fewer points"
    )]
    BufferTooLarge {
        /// What for.
        what: &'static str,
        /// Bytes asked for.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// More points than ids.
    #[error("{n_points} points are too many to draw; {limit} is the most that the view can number")]
    TooManyPoints {
        /// Points given.
        n_points: usize,
        /// Points that can be numbered.
        limit: usize,
    },
    /// Slices that do not belong together.
    #[error("{what}: expected {expected}, found {found}")]
    Mismatch {
        /// Which slice.
        what: &'static str,
        /// What its partner asks for.
        expected: usize,
        /// What it has.
        found: usize,
    },
    /// The graphics memory is full.
    #[error("the graphics memory is too small for {n_points} points ({needed} bytes): {reason}")]
    OutOfMemory {
        /// Points given.
        n_points: usize,
        /// Bytes asked for.
        needed: u64,
        /// What the driver says.
        reason: String,
    },
    /// No graphics adapter at all.
    #[error(
        "no graphics adapter found ({reason}); install a driver, on Debian and Ubuntu the packages \
         mesa-vulkan-drivers and libvulkan1 (they also draw in software, without a graphics card)"
    )]
    NoAdapter {
        /// What was looked for.
        reason: String,
    },
    /// An adapter that lacks something that this renderer cannot do without.
    #[error(
        "the graphics adapter {adapter} cannot draw splats: it lacks {lacks}; a newer driver may help, on Debian and \
         Ubuntu the packages mesa-vulkan-drivers and libvulkan1"
    )]
    Unsupported {
        /// The adapter's name.
        adapter: String,
        /// What is missing.
        lacks: &'static str,
    },
    /// The driver refused to open the adapter.
    #[error("the graphics adapter {adapter} could not be opened: {reason}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// A picture that cannot be drawn at its size.
    #[error("a picture of {width}x{height} pixels cannot be drawn ({reason}); try a smaller one")]
    Picture {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Why.
        reason: String,
    },
    /// The caller's progress said to stop.
    #[error("the picture was canceled")]
    Canceled,
}
