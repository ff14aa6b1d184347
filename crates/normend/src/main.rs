//! normend
fn main() {}
