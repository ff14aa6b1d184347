//! Pictures, checked by counting pixels, and shaders, checked without a GPU.

mod pictures;
mod scene;
mod shaders;
