//! The speed of the chain.
fn main() {}
