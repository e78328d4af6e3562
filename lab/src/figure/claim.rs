//! What a paper says, and what was found.

use std::fmt::Write;

use crate::bootstrap::Interval;

use crate::bench::report::known;

/// A claim beside what was found.
#[derive(Clone, Debug)]
pub(crate) struct Claim {
    /// The row of the specification's table that asks for it.
    pub(crate) id: &'static str,
    pub(crate) text: String,
    /// Where it was looked for.
    pub(crate) scene: String,
    pub(crate) found: String,
    /// `None` if what was measured does not decide it.
    pub(crate) holds: Option<bool>,
}

impl Claim {
    /// What is known of a claim.
    pub(crate) fn new(
        id: &'static str,
        text: impl Into<String>,
        scene: &str,
        found: impl Into<String>,
        holds: Option<bool>,
    ) -> Self {
        Self { id, text: text.into(), scene: scene.to_owned(), found: found.into(), holds }
    }

    /// That a number lies between `low` and `high`; it is not known if the reference is too noisy.
    pub(crate) fn of_interval(
        id: &'static str,
        text: impl Into<String>,
        scene: &str,
        found: Option<Interval>,
        [low, high]: [f64; 2],
    ) -> Self {
        let holds = found.and_then(|found| found.inside(low, high));
        Self { id, text: text.into(), scene: scene.to_owned(), found: known(found), holds }
    }
}

/// Whether all of several things are so: not if one is not, and unknown if one of the others is.
pub(crate) fn all(verdicts: impl IntoIterator<Item = Option<bool>>) -> Option<bool> {
    verdicts
        .into_iter()
        .try_fold(Some(true), |so_far, verdict| match verdict {
            Some(false) => Err(Some(false)),
            Some(true) => Ok(so_far),
            None => Ok(None),
        })
        .unwrap_or_else(|known| known)
}

/// The claims as a table.
pub(crate) fn table(claims: &[Claim]) -> String {
    let mut text = "| | claim | scene | found | holds |\n|---|---|---|---|---|\n".to_owned();
    for Claim { id, text: claim, scene, found, holds } in claims {
        let verdict = match holds {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "undecided",
        };
        let _ = writeln!(text, "| {id} | {claim} | {scene} | {found} | {verdict} |");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_is_not_so_decides() {
        assert_eq!(all([]), Some(true));
        assert_eq!(all([Some(true), Some(true)]), Some(true));
        assert_eq!(all([Some(true), None]), None);
        assert_eq!(all([None, Some(false), Some(true)]), Some(false));
    }
}
