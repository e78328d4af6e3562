//! Ctrl-C and termination. While it renders, the first request lets the dispatch in work end, and the second ends the program; at other
//! times, as while a scene is built, the first ends it at once. None leaves a part of a file behind, for while files are written all wait.

use std::sync::atomic::{AtomicBool, Ordering};

use restir::Error;
use restir::advanced::output;

use super::console;

/// The exit code of an interrupted program: 128 + SIGINT.
pub(super) const EXIT_CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);
static LISTENING: AtomicBool = AtomicBool::new(false);
/// Somebody has the last word: the end of the program, or a signal.
static ENDING: AtomicBool = AtomicBool::new(false);

/// From now on a signal makes [`check`] fail.
pub(super) fn install() -> Result<(), Error> {
    let handler = || {
        let again = REQUESTED.swap(true, Ordering::SeqCst);
        let heard = LISTENING.load(Ordering::SeqCst) && !again;
        if !heard {
            let _settled = output::settled();
            if !ENDING.swap(true, Ordering::SeqCst) {
                if !again {
                    console::note(&format!("error: {}", Error::Interrupted));
                }
                leave();
            }
        }
    };
    ctrlc::set_handler(handler).map_err(|error| Error::Setting(format!("cannot listen for Ctrl-C: {error}")))
}

/// Ends the program at once. A thread of a driver may be at work, and would crash in what the driver's own ending takes down.
fn leave() -> ! {
    let code = i32::from(EXIT_CODE);
    // SAFETY: it ends the process, and runs nothing before.
    #[cfg(unix)]
    unsafe {
        libc::_exit(code)
    }
    #[cfg(not(unix))]
    std::process::exit(code)
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

/// Does work that asks [`check`] often.
pub(super) fn listening<T>(work: impl FnOnce() -> T) -> T {
    LISTENING.store(true, Ordering::SeqCst);
    let done = work();
    LISTENING.store(false, Ordering::SeqCst);
    done
}

/// From now on files are written: nothing ends the program before they are whole.
pub fn begin_writing() {
    static WRITING: AtomicBool = AtomicBool::new(false);
    if !WRITING.swap(true, Ordering::SeqCst) {
        std::mem::forget(output::making());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes after work that asks would take a signal for heard, and go on.
    #[test]
    fn nobody_listens_after_the_work() {
        assert!(listening(|| LISTENING.load(Ordering::SeqCst)));
        assert!(!LISTENING.load(Ordering::SeqCst));
    }
}
