//! Native against device, word by word: every kernel, case, adapter and flavour.

use crate::words::{Word, Words};
use restir_host::Error;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::metrics::ulp_distance;
use restir_host::plan::{Buffer, FramePlan, Pass};
use restir_kernels::{Access, Binding, Case};
use std::fmt;
use std::sync::Arc;

/// Outputs begin as this: an invocation that ends early leaves it behind. It is a NaN.
pub const POISON: u32 = 0x7fc0_dead;
/// How many differing words a report lists.
const LISTED: usize = 8;

/// A word that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Name of the buffer.
    pub buffer: &'static str,
    /// Index of the element.
    pub element: usize,
    /// Index of the word in the element.
    pub word: usize,
    /// The host's word.
    pub host: u32,
    /// The device's word.
    pub device: u32,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffer, element, word, host, device } = *self;
        let (a, b) = (f32::from_bits(host), f32::from_bits(device));
        let ulp = ulp_distance(a, b);
        write!(f, "{buffer}[{element}] word {word}: host {host:08x} ({a:e}), device {device:08x} ({b:e}), {ulp} ulp")
    }
}

/// The result of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Words compared.
    pub words: usize,
    /// Words that differ; two NaN do not, for their bits are unspecified.
    pub differing: usize,
    /// The largest distance between two words, as f32.
    pub max_ulp: u32,
    /// Elements compared: pixels, or whatever a buffer holds.
    pub elements: usize,
    /// Elements with a word that is farther than rounding explains: a number by 5e-4 of its size, an integer at all.
    pub far: usize,
    /// Words that are.
    pub far_words: usize,
    /// Words that still hold the poison on either side.
    pub poisoned: usize,
    /// The first few differences.
    pub first: Vec<Difference>,
}

impl Outcome {
    /// All words are equal and all were written.
    pub fn is_exact(&self) -> bool {
        self.differing == 0 && self.poisoned == 0
    }

    /// The share of elements that are far from the host's.
    pub fn far_share(&self) -> f64 {
        self.far as f64 / self.elements.max(1) as f64
    }

    /// The share of words that are.
    pub fn far_words_share(&self) -> f64 {
        self.far_words as f64 / self.words.max(1) as f64
    }

    /// Whether the word is far from the host's.
    fn record(&mut self, word: Word, difference: Difference) -> bool {
        let Difference { host, device, .. } = difference;
        let [a, b] = [host, device].map(f32::from_bits);
        let is_far = !word.is_near(host, device);
        self.words += 1;
        self.far_words += usize::from(is_far);
        self.poisoned += usize::from(host == POISON || device == POISON);
        if host != device && !(a.is_nan() && b.is_nan()) {
            self.differing += 1;
            self.max_ulp = self.max_ulp.max(ulp_distance(a, b));
            if self.first.len() < LISTED {
                self.first.push(difference);
            }
        }
        is_far
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_exact() {
            return write!(f, "exact, {} words", self.words);
        }
        write!(f, "approximate, {} of {} words differ, max {} ulp", self.differing, self.words, self.max_ulp)?;
        if self.poisoned > 0 {
            write!(f, ", {} words were never written", self.poisoned)?;
        }
        Ok(())
    }
}

/// Runs a case on an executor: the words of the kernel's [`Access::Own`] buffers.
///
/// # Errors
/// Whatever the executor reports.
pub fn run(executor: &mut dyn Executor, case: &Case) -> Result<Vec<Vec<u32>>, Error> {
    executor.run(plan(case))
}

/// The plan of a case: one pass, which gives the kernel's [`Access::Own`] buffers.
pub fn plan(case: &Case) -> FramePlan<'static> {
    let (kernel, invocations) = (case.kernel, case.grid[0] as usize * case.grid[1] as usize);
    let bindings = &kernel.bindings[1..];
    let buffer = |(binding, contents): (&Binding, &Option<Arc<[u32]>>)| {
        let poison = || vec![POISON; invocations * binding.stride as usize / 4].into();
        let contents = contents.clone().unwrap_or_else(poison);
        Buffer { name: binding.name, words: contents.len(), contents: Some(contents) }
    };
    let pass = Pass {
        frame: None,
        kernel,
        constants: case.constants.clone(),
        params: case.buffers[0].as_deref().unwrap_or_default().to_vec(),
        bindings: (0..bindings.len()).collect(),
        grid: case.grid,
        waiting: None,
    };
    let buffers = bindings.iter().zip(&case.buffers[1..]).map(buffer).collect();
    let outputs = (0..bindings.len()).filter(|&i| bindings[i].access == Access::Own).collect();
    FramePlan::of(buffers, vec![pass], outputs)
}

/// Runs a case natively and on `device`, and compares.
///
/// # Errors
/// Whatever the executors report.
pub fn compare(device: &mut dyn Executor, case: &Case) -> Result<Outcome, Error> {
    compare_with(&mut CpuExecutor::inline(), device, case)
}

/// As [`compare`], by an executor that stands for the host.
///
/// # Errors
/// Whatever the executors report.
pub fn compare_with(host: &mut dyn Executor, device: &mut dyn Executor, case: &Case) -> Result<Outcome, Error> {
    let host = run(host, case)?;
    let device = run(device, case)?;
    let mut outcome = Outcome::default();
    let own = case.kernel.bindings.iter().filter(|b| b.access == Access::Own);
    for ((binding, host), device) in own.zip(&host).zip(&device) {
        let stride = binding.stride as usize / 4;
        let words = Words::of(case.kernel, binding).ok_or_else(|| {
            let problem = format!("writes {}, whose words nothing is known of; add them to words.rs", binding.name);
            Error::Kernel { kernel: case.kernel.name.to_owned(), source: problem.into() }
        })?;
        for (element, (host, device)) in host.chunks(stride).zip(device.chunks(stride)).enumerate() {
            let mut far = false;
            for (at, (kind, (&a, &b))) in words.element(host).zip(host.iter().zip(device)).enumerate() {
                let difference = Difference { buffer: binding.name, element, word: at, host: a, device: b };
                far |= outcome.record(kind, difference);
            }
            outcome.elements += 1;
            outcome.far += usize::from(far);
        }
    }
    Ok(outcome)
}
