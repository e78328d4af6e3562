//! The list of techniques: one line each.

use super::{Technique, path::PathSettings, restir_di::DiSettings};
use crate::Error;

/// Every technique with its default settings, in the order in which they are listed.
pub fn all() -> Vec<Box<dyn Technique>> {
    vec![PathSettings::default().into(), DiSettings::default().into()]
}

/// The technique of that name with its default settings.
///
/// # Errors
/// [`Error::Setting`] for an unknown name, which lists those that there are.
pub fn named(name: &str) -> Result<Box<dyn Technique>, Error> {
    let mut all = all();
    let Some(index) = all.iter().position(|technique| technique.about().name == name) else {
        let known: Vec<&str> = all.iter().map(|technique| technique.about().name).collect();
        return Err(Error::Setting(format!("there is no technique {name:?}; there are: {}", known.join(", "))));
    };
    Ok(all.swap_remove(index))
}
