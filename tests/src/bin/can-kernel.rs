//! `can-kernel [--interfaces A,B] [--module PATH] [--writable FOLDER] [--] COMMAND [ARGUMENT...]`: runs a command in a kernel with CAN.

use std::path::Path;
use std::process::{Command, ExitCode};

use axisbridge_tests::can_kernel::{self, Kernel};

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1).peekable();
    let mut kernel = Kernel::new();
    while let Some(option) = words.next_if(|word| word.starts_with("--")) {
        if option == "--" {
            break;
        }
        let value = words.next().unwrap_or_default();
        kernel = match option.as_str() {
            "--interfaces" => kernel.interfaces(&value.split(',').collect::<Vec<_>>()),
            "--module" => kernel.module(&value),
            "--writable" => kernel.writable(Path::new(&value)),
            _ => {
                eprintln!("error: unknown option {option}");
                return ExitCode::from(2);
            }
        };
    }
    let Some(program) = words.next() else {
        eprintln!("error: expected a command");
        return ExitCode::from(2);
    };
    if !can_kernel::available() {
        eprintln!("error: there is no User-Mode Linux here (Debian package user-mode-linux)");
        return ExitCode::FAILURE;
    }
    let finished = kernel.run(Command::new(program).args(words));
    print!("{}", finished.stdout);
    eprint!("{}", finished.stderr);
    ExitCode::from(u8::try_from(finished.status).unwrap_or(125))
}
