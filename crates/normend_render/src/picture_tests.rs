//! Pictures, checked by counting pixels, and shaders, checked without a GPU.

mod marks;
mod pictures;
mod scene;
mod shaders;
