//! Two runs of a plan, all buffers compared after every pass: where they part.

use crate::parity::Difference;
use crate::suite::ensure;
use libtest_mimic::Failed;
use restir_host::Error;
use restir_host::exec::{Executor, Step};
use restir_host::plan::FramePlan;
use std::fmt;

/// The words of all buffers after every pass.
pub type Trace = Vec<Vec<Vec<u32>>>;

/// The first word in which two runs differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Divergence {
    /// The frame of a scene that moves.
    pub frame: u32,
    /// Index of the pass in the run.
    pub pass: usize,
    /// Its kernel.
    pub kernel: &'static str,
    /// Where in the buffer, and the words.
    pub difference: Difference,
    /// Of a plane, the element's pixel.
    pub pixel: Option<[u32; 2]>,
    /// Words of the buffer that differ.
    pub differing: usize,
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frame, pass, kernel, difference, pixel, differing } = self;
        write!(f, "frame {frame}, pass {pass} ({kernel}), ")?;
        if let Some([x, y]) = pixel {
            write!(f, "pixel ({x}, {y}), ")?;
        }
        write!(f, "{difference}; {differing} words of the buffer differ")
    }
}

fn read_all(step: &Step<'_>, buffers: usize) -> Result<Vec<Vec<u32>>, Error> {
    (0..buffers).map(|id| step.read(id)).collect()
}

/// Runs a plan and keeps everything.
///
/// # Errors
/// Whatever the executor reports.
pub fn trace(executor: &mut dyn Executor, plan: FramePlan<'_>) -> Result<Trace, Error> {
    let (buffers, mut trace) = (plan.buffers.len(), Vec::new());
    executor.run_observed(plan, &mut |step| {
        trace.push(read_all(step, buffers)?);
        Ok(())
    })?;
    Ok(trace)
}

/// Runs a plan until it leaves the trace of another run, the host's; `None` if it never does.
///
/// # Errors
/// Whatever the executor reports, and if the runs have not the same number of passes.
pub fn first_divergence(
    executor: &mut dyn Executor,
    plan: FramePlan<'_>,
    host: &Trace,
) -> Result<Option<Divergence>, Failed> {
    let names: Vec<&'static str> = plan.buffers.iter().map(|buffer| buffer.name).collect();
    let (mut begun, mut passes, mut found) = (0_u32, 0, None);
    let run = executor.run_observed(plan, &mut |step| {
        begun += u32::from(step.pass.frame.is_some());
        if let Some(host) = host.get(passes) {
            let place = |divergence| Divergence { frame: begun.saturating_sub(1), pass: passes, ..divergence };
            found = divergence(step, &names, host)?.map(place);
        }
        passes += 1;
        if found.is_some() { Err(Error::Interrupted) } else { Ok(()) }
    });
    if found.is_none() {
        run?;
        ensure(passes == host.len(), || format!("{passes} passes instead of {}", host.len()))?;
    }
    Ok(found)
}

/// The first difference of a step's buffers from the host's; its frame and number are for the caller.
fn divergence(step: &Step<'_>, names: &[&'static str], host: &[Vec<u32>]) -> Result<Option<Divergence>, Error> {
    let [width, height] = step.pass.grid;
    for (buffer, (words, host)) in names.iter().zip(read_all(step, names.len())?.iter().zip(host)) {
        let mut differing = host.iter().zip(words).enumerate().filter(|(_, (host, device))| host != device);
        let Some((at, (&host, &device))) = differing.next() else { continue };
        let (element, word) = (at / 4, at % 4);
        let is_plane = words.len() == 4 * (width * height) as usize;
        return Ok(Some(Divergence {
            frame: 0,
            pass: 0,
            kernel: step.pass.kernel.name,
            difference: Difference { buffer, element, word, host, device },
            pixel: is_plane.then(|| [element as u32 % width, element as u32 / width]),
            differing: 1 + differing.count(),
        }));
    }
    Ok(None)
}
