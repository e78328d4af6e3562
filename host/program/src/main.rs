//! The program `restir`; see the library of this crate.

fn main() -> std::process::ExitCode {
    restir_cli::main()
}
