//! Ctrl-C and termination. The first request lets the dispatch in work end; the second ends the program at once.
//! Neither leaves a file behind, for while files are written both wait.

use std::sync::atomic::{AtomicBool, Ordering};

use restir::Error;

/// The exit code of an interrupted program: 128 + SIGINT.
pub(super) const EXIT_CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);
static WRITING: AtomicBool = AtomicBool::new(false);

/// From now on a signal makes [`check`] fail.
pub(super) fn install() -> Result<(), Error> {
    let handler = || {
        let again = REQUESTED.swap(true, Ordering::SeqCst);
        if again && !WRITING.load(Ordering::SeqCst) {
            std::process::exit(i32::from(EXIT_CODE));
        }
    };
    ctrlc::set_handler(handler).map_err(|error| Error::Setting(format!("cannot listen for Ctrl-C: {error}")))
}

/// An error once the user wants the program to stop.
pub(super) fn check() -> Result<(), Error> {
    if REQUESTED.load(Ordering::SeqCst) { Err(Error::Interrupted) } else { Ok(()) }
}

/// From now on files are written: nothing ends the program before they are whole.
pub(super) fn begin_writing() {
    WRITING.store(true, Ordering::SeqCst);
}
