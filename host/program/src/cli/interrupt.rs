//! Ctrl-C and termination. While a scene is built, the first request ends the program at once. Once it renders, the first lets the
//! dispatch in work end, and the second ends the program. None leaves a file behind, for while files are written all wait.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use restir::Error;

use super::console;

/// The exit code of an interrupted program: 128 + SIGINT.
pub(super) const EXIT_CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);
static LISTENING: AtomicBool = AtomicBool::new(false);
/// Somebody has the last word: the end of the program, or a signal.
static ENDING: AtomicBool = AtomicBool::new(false);
/// Held while there may be a file that is not whole.
static FILES: Mutex<()> = Mutex::new(());

/// From now on a signal makes [`check`] fail.
pub(super) fn install() -> Result<(), Error> {
    let handler = || {
        let again = REQUESTED.swap(true, Ordering::SeqCst);
        let heard = LISTENING.load(Ordering::SeqCst) && !again;
        if !heard {
            let _whole = FILES.lock();
            if !ENDING.swap(true, Ordering::SeqCst) {
                if !again {
                    console::note(&format!("error: {}", Error::Interrupted));
                }
                std::process::exit(i32::from(EXIT_CODE));
            }
        }
    };
    ctrlc::set_handler(handler).map_err(|error| Error::Setting(format!("cannot listen for Ctrl-C: {error}")))
}

/// An error once the user wants the program to stop.
pub(super) fn check() -> Result<(), Error> {
    if REQUESTED.load(Ordering::SeqCst) { Err(Error::Interrupted) } else { Ok(()) }
}

/// The program ends by itself, and says with which error: a signal that comes now has nothing to add. One that came before ends it.
pub(super) fn begin_ending() {
    while ENDING.swap(true, Ordering::SeqCst) {
        std::thread::park();
    }
}

/// From now on [`check`] is asked often.
pub(super) fn begin_listening() {
    LISTENING.store(true, Ordering::SeqCst);
}

/// From now on files are written: nothing ends the program before they are whole.
pub(super) fn begin_writing() {
    static WRITING: AtomicBool = AtomicBool::new(false);
    if !WRITING.swap(true, Ordering::SeqCst) {
        std::mem::forget(FILES.lock());
    }
}

/// Writes files, while nothing ends the program; more may come later.
pub(super) fn whole<T>(write: impl FnOnce() -> T) -> T {
    let _whole = FILES.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}

/// As [`restir::output::check_writable`], which makes a file for a moment.
pub(super) fn check_writable(path: &Path) -> Result<(), Error> {
    whole(|| restir::output::check_writable(path))
}
