//! Random numbers that are the same everywhere and always.

use std::f64::consts::TAU;

use glam::DVec3;

/// SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
pub(crate) struct Random {
    state: u64,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The `index`-th of many generators that follow from one seed, so that work can be shared between threads.
    pub fn stream(seed: u64, index: usize) -> Self {
        let own = Self::new(index as u64).bits();
        Self::new(Self::new(seed).bits() ^ own)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// Even in (0, 1].
    pub fn unit(&mut self) -> f64 {
        ((self.bits() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// Gaussian with mean 0 and standard deviation 1 (Box and Muller).
    pub fn gaussian(&mut self) -> f32 {
        let radius = (-2.0 * self.unit().ln()).sqrt();
        (radius * (TAU * self.unit()).cos()) as f32
    }

    /// A unit vector, even over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(across * cos, across * sin, z)
    }
}
