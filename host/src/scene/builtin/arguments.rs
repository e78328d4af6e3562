//! Arguments of a built-in scene, behind its name: `slab:depth=4,albedo=0.99`.

use std::ops::RangeInclusive;

use crate::Error;

/// What is written behind a scene's name.
pub(super) struct Arguments<'a> {
    scene: &'a str,
    given: Vec<(&'a str, &'a str)>,
}

impl<'a> Arguments<'a> {
    /// Of the whole name of a scene, of which `known` are the arguments.
    pub(super) fn parse(scene: &'a str, text: &'a str, known: &[&str]) -> Result<Self, Error> {
        let mut arguments = Self { scene, given: Vec::new() };
        for part in text.split(',') {
            let Some((key, value)) = part.split_once('=').filter(|(key, _)| known.contains(key)) else {
                return Err(arguments
                    .refuse(format!("{part:?} is no argument of it; give {}=... for instance", known.join("=..., "))));
            };
            if arguments.get(key).is_some() {
                return Err(arguments.refuse(format!("{key} is given twice; give it once")));
            }
            arguments.given.push((key, value));
        }
        Ok(arguments)
    }

    /// A number, or the usual one.
    pub(super) fn number(&self, key: &str, usual: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
        let Some(text) = self.get(key) else { return Ok(usual) };
        let number = text.parse().ok().filter(|number| range.contains(number));
        let problem = || format!("{key} is {text:?}; give a number from {} to {}", range.start(), range.end());
        number.ok_or_else(|| self.refuse(problem()))
    }

    /// One of some values by its name, or the first of them.
    pub(super) fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<T, Error> {
        let named = |text: &str| choices.iter().find(|(name, _)| *name == text);
        let found = self.get(key).map_or(choices.first(), named).map(|(_, value)| *value);
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        let problem = || format!("{key} is {:?}; give one of {}", self.get(key).unwrap_or_default(), names.join(", "));
        found.ok_or_else(|| self.refuse(problem()))
    }

    fn get(&self, key: &str) -> Option<&'a str> {
        self.given.iter().find(|(of, _)| *of == key).map(|(_, value)| *value)
    }

    fn refuse(&self, problem: String) -> Error {
        Error::Scene { scene: self.scene.to_owned(), problem }
    }
}
