//! The `axisbridge` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    axisbridge::cli::main()
}
