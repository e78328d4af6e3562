//! Why a command did not end well: the sentence that says so, what to do in this program, and the exit code.

use restir::Error;

use super::{environment, interrupt};

const EXIT_FAILED: u8 = 1;
pub(super) const EXIT_BAD_INPUT: u8 = 2;

/// Why a command did not end well.
#[derive(Debug, thiserror::Error)]
pub enum Ending {
    /// What was asked for cannot be done.
    #[error("{0}{hint}", hint = hint(.0))]
    Error(#[from] Error),
    /// A comparison that was asked for did not pass.
    #[error("{0}")]
    Failed(String),
}

impl Ending {
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::Error(Error::Interrupted) => interrupt::EXIT_CODE,
            Self::Error(_) => EXIT_BAD_INPUT,
            Self::Failed(_) => EXIT_FAILED,
        }
    }
}

/// What a user of this program can do about an error of the library.
fn hint(error: &Error) -> &'static str {
    match error {
        Error::Memory { .. } => environment::MEMORY_HINT,
        Error::Adapter(_) => "; --device cpu renders without an adapter",
        Error::Medium { .. } => {
            "; give --subsurface as MEDIUM:SCALE, where SCALE is how long a millimetre is, or leave it out"
        }
        Error::NoLayers { .. } => "; leave out --layers",
        Error::Module { .. } => "; `cargo xtask shader build` in the project's repository makes the modules again",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::advanced::error::AdapterError;

    #[test]
    fn an_error_of_the_library_gets_the_advice_of_the_program() {
        let lost = Ending::from(Error::from(AdapterError::None));
        assert!(lost.to_string().ends_with("; --device cpu renders without an adapter"), "{lost}");
        let ends: [(Ending, u8); 3] =
            [(lost, 2), (Error::Interrupted.into(), 130), (Ending::Failed("worse".to_owned()), 1)];
        for (ending, code) in ends {
            assert_eq!(ending.exit_code(), code, "{ending}");
        }
    }
}
