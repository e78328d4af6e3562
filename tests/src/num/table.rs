//! The result as a table.

use super::Tally;
use std::fmt;

/// What a sweep of one function found.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The function.
    pub function: &'static str,
    /// Which of its forms: on the device, on the host, on both, or only its correction step.
    pub form: &'static str,
    /// The operands.
    pub domain: &'static str,
    /// The finding.
    pub tally: Tally,
    claim: Claim,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Claim {
    CorrectlyRounded,
    Accurate,
    /// As accurate; the input is the number of a random sample.
    AccurateOnSamples,
}

impl Row {
    pub(super) fn rounding(function: &'static str, form: &'static str, domain: &'static str, tally: Tally) -> Self {
        Self { function, form, domain, tally, claim: Claim::CorrectlyRounded }
    }

    pub(super) fn accuracy(function: &'static str, domain: &'static str, tally: Tally) -> Self {
        Self { function, form: "both", domain, tally, claim: Claim::Accurate }
    }

    pub(super) fn accuracy_of_samples(function: &'static str, domain: &'static str, tally: Tally) -> Self {
        Self { claim: Claim::AccurateOnSamples, ..Self::accuracy(function, domain, tally) }
    }

    /// Whether the function is as good as claimed.
    pub fn passed(&self) -> bool {
        self.tally.inputs > 0 && self.tally.failures == 0
    }

    /// The function, and whether this is about its correction step only.
    pub fn group(&self) -> (&'static str, bool) {
        (self.function, self.form == "correction")
    }

    fn result(&self) -> String {
        match self.claim {
            Claim::CorrectlyRounded if self.passed() => "correctly rounded".to_owned(),
            Claim::CorrectlyRounded => format!("{} wrong", self.tally.failures),
            Claim::Accurate | Claim::AccurateOnSamples => format!("{:.3} ulp", self.tally.worst),
        }
    }

    fn worst_input(&self) -> String {
        let input = self.tally.worst_input;
        if self.tally.worst == 0.0 {
            String::new()
        } else if self.claim == Claim::AccurateOnSamples {
            format!("sample {input}")
        } else if self.form == "correction" || input >> 32 == 0 && self.claim == Claim::CorrectlyRounded {
            format!("`{input:#x}`")
        } else if input >> 32 == 0 {
            format!("`{:e}`", f32::from_bits(input as u32))
        } else {
            format!("`{:e}, {:e}`", f32::from_bits((input >> 32) as u32), f32::from_bits(input as u32))
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inputs = self.tally.inputs.to_string();
        let cells = [self.function, self.form, self.domain, &inputs, &self.result(), &self.worst_input()];
        write!(f, "| {} |", cells.join(" | "))
    }
}

/// The rows as a Markdown table.
pub fn markdown(rows: &[Row]) -> String {
    let head = "| function | form | operands | tested | result | worst at |\n|---|---|---|---:|---|---|\n";
    rows.iter().fold(head.to_owned(), |text, row| text + &row.to_string() + "\n")
}
