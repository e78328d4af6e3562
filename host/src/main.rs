//! The program `restir`; see [`restir_host::cli`].

fn main() -> std::process::ExitCode {
    restir_host::cli::main()
}
