//! The `axisbridge` command.

fn main() {}
