//! The `apsides` program.
fn main() {}
