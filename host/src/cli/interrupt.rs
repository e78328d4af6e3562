//! Ctrl-C and termination: remembered, so that work can stop at a good place and clean up.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::Error;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on a signal only makes [`requested`] true.
pub(super) fn install() -> Result<(), Error> {
    ctrlc::set_handler(|| REQUESTED.store(true, Ordering::Relaxed))
        .map_err(|error| Error::Setting(format!("cannot listen for Ctrl-C: {error}")))
}

/// Whether the user wants the program to stop.
pub(super) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
