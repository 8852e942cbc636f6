//! The program: `servosim help` says what it does, the library how.

fn main() -> std::process::ExitCode {
    servosim::cli::main()
}
