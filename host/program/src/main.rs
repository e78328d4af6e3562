//! The program `restir`; see [`cli`].

mod bench;
mod cli;
mod figure;

fn main() -> std::process::ExitCode {
    cli::main()
}
