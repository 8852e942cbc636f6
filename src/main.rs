//! servosim: see the library.

fn main() {}
