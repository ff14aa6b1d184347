//! Pictures, checked by counting pixels, and shaders, checked without a GPU.

mod big_pictures;
mod marks;
mod pictures;
mod scene;
mod shaders;
