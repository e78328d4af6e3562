//! `cargo xtask shader`: the SPIR-V modules from source to the committed files, and every check of them.
//!
//! One module is built for each entry point and [`flavour`](Flavour). The order of the steps is part of the numeric
//! contract: [`compile`] without the backend's optimiser, [`post`], [`canonical`], `spirv-opt`, for naga `inserts` and `loops`, [`canonical`] again, `spirv-val`, then
//! [`verify`] over the final binary ([`allow`], [`limits`], [`reflect`], [`portable`]).

mod build;
pub mod cargo_files;
pub mod check;
pub mod compile;
pub mod cost;
pub mod digest;
pub mod flavour;
mod foreign;
mod inserts;
pub mod install;
pub mod limits;
mod loops;
pub mod manifest;
pub mod pipeline;
pub mod portable;
pub mod publish;
pub mod reflect;
pub mod toolchain;
pub mod tools;
pub mod verify;
pub mod workspace;

pub use flavour::{Entry, Flavour};
pub use spirv_exact::{allow, canonical, module, post};

use std::path::PathBuf;

use crate::Error;
use workspace::Workspace;

/// Subcommands of `cargo xtask shader`.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Compile all kernels in both flavours, check them, and replace the files in kernels/spirv.
    Build {
        /// Compile the kernels of this crate instead, which has a feature `fast`.
        #[arg(long = "crate", value_name = "FOLDER", requires = "out")]
        of: Option<PathBuf>,
        /// Where its modules go.
        #[arg(long, value_name = "FOLDER", requires = "of")]
        out: Option<PathBuf>,
        /// Consent to downloading and building the rust-gpu toolchain if there is none.
        #[arg(long)]
        install_toolchain: bool,
    },
    /// Check the committed modules, and rebuild them if a toolchain is there.
    Check {
        /// Fail unless they were rebuilt with the toolchain of the manifest.
        #[arg(long)]
        require_rebuild: bool,
    },
    /// Print the assembly of a committed module.
    Dis {
        /// Name of the kernel.
        kernel: String,
        /// Which build of it.
        #[arg(long, value_parser = flavour::parser(), default_value_t)]
        flavour: Flavour,
    },
    /// Registers, spills and waves of kernels.
    Cost(cost::Options),
    /// One build of the kernel crate; `build` starts it as a child process.
    #[command(hide = true)]
    Compile {
        /// The build, as JSON.
        job: String,
    },
}

/// Runs a subcommand.
pub fn run(command: Command) -> Result<(), Error> {
    let workspace = Workspace::current();
    match command {
        Command::Build { of: Some(of), out: Some(out), install_toolchain } => {
            foreign::run(&workspace, &of, &out, install_toolchain)
        }
        Command::Build { install_toolchain, .. } => build::run(&workspace, install_toolchain),
        Command::Check { require_rebuild } => check::run(&workspace, require_rebuild),
        Command::Dis { kernel, flavour } => dis(&workspace, &kernel, flavour),
        Command::Cost(options) => cost::run(&workspace, &options),
        Command::Compile { job } => compile::Job::run(&job),
    }
}

fn dis(workspace: &Workspace, kernel: &str, flavour: Flavour) -> Result<(), Error> {
    let names: Vec<&str> = restir_kernels::all().iter().map(|k| k.name).collect();
    if !names.contains(&kernel) {
        return Err(Error::Environment(format!("no kernel `{kernel}`: the kernels are {}", names.join(", "))));
    }
    let module = workspace.spirv().join(Entry::new(flavour, kernel).path());
    if !module.is_file() {
        let path = module.display();
        return Err(Error::Environment(format!("{path} is not there: run `cargo xtask shader build`")));
    }
    print!("{}", tools::disassemble(&module)?);
    Ok(())
}
