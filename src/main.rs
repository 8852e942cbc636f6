//! The program: `servosim help` tells what it does, the library how.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
