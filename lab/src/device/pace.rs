//! How long frames take, after some that warm up, in as many as there is time for.

use restir_host::buffers::SceneBuffers;
use restir_host::exec::GpuExecutor;
use restir_host::exec::gpu::{Span, Timeline};
use restir_host::plan::FramePlan;
use restir_host::render::{Render, Shows};
use restir_host::technique::Repeats;

use crate::Error;
use crate::bench::fit::median;

/// Frames before the first that counts: caches are warm then, and reservoirs full.
const SETTLING: u32 = 3;
/// Frames by which it is estimated how many there is time for.
const TRIED: u32 = 2;
/// Samples that are submitted one after the other, if there is time.
const SAMPLES: u32 = 8;
/// Measurements, of which the median counts. Where one alone takes more than the time there is, one has to do.
const FEWEST: u32 = 3;
const MOST: u32 = 31;

/// What a frame takes, or a sample.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Took {
    /// Milliseconds from its beginning to the next one's.
    pub(super) milliseconds: f64,
    /// Milliseconds of the passes of each kernel; none where the device has no clock.
    pub(super) kernels: Vec<(&'static str, f64)>,
}

/// How many measurements of so many seconds there is time for.
fn measurements(time: f64, each: f64) -> u32 {
    if each > time { 1 } else { ((time / each) as u32).clamp(FEWEST, MOST) }
}

/// Measures in about `time` seconds. A frame shows an image.
pub(super) fn took(gpu: &mut GpuExecutor, scene: &SceneBuffers, render: &Render, time: f64) -> Result<Took, Error> {
    render.check(scene)?;
    match render.technique.about().repeats {
        Repeats::Samples => of_samples(gpu, scene, render, time),
        Repeats::Frames => of_frames(gpu, scene, render, time),
    }
}

fn of_samples(gpu: &mut GpuExecutor, scene: &SceneBuffers, render: &Render, time: f64) -> Result<Took, Error> {
    let mut run = |count| gpu.run_timed(Render { count, ..render.clone() }.plan(scene));
    run(1)?;
    let estimate = run(1)?.seconds;
    let samples = ((time / estimate) as u32).clamp(1, SAMPLES);
    let runs = measurements(time, f64::from(samples) * estimate);
    let all = (0..runs).map(|_| Ok(of_run(&run(samples)?, f64::from(samples)))).collect::<Result<Vec<_>, Error>>()?;
    Ok(middle(&all))
}

fn of_run(run: &Timeline, samples: f64) -> Took {
    let seconds = run.spans.first().zip(run.spans.last()).map_or(run.seconds, |(first, last)| last.end - first.begin);
    Took { milliseconds: 1.0e3 * seconds / samples, kernels: kernels(&run.spans, samples) }
}

fn of_frames(gpu: &mut GpuExecutor, scene: &SceneBuffers, render: &Render, time: f64) -> Result<Took, Error> {
    let so_many = |count| Render { count, shows: Shows::Each, ..render.clone() };
    let few = so_many(TRIED);
    gpu.run_timed(few.plan(scene))?;
    let estimate = gpu.run_timed(few.plan(scene))?.seconds / f64::from(TRIED);
    let count = SETTLING + measurements(time, estimate);
    // the frame after the last one says when that ended
    let run = gpu.run_timed(so_many(count + 1).plan(scene))?;
    if run.spans.is_empty() {
        return Ok(Took { milliseconds: 1.0e3 * run.seconds / f64::from(count + 1), kernels: Vec::new() });
    }
    let begins: Vec<usize> = (SETTLING..=count).map(|frames| so_many(frames).plan(scene).pass_count as usize).collect();
    let frame = |ends: &[usize]| {
        let (spans, next) = (&run.spans[ends[0]..ends[1]], run.spans[ends[1]]);
        Took { milliseconds: 1.0e3 * (next.begin - spans[0].begin), kernels: kernels(spans, 1.0) }
    };
    Ok(middle(&begins.windows(2).map(frame).collect::<Vec<_>>()))
}

/// Milliseconds of each kernel over a number of repeats, in the order of their first passes.
fn kernels(spans: &[Span], repeats: f64) -> Vec<(&'static str, f64)> {
    let mut kernels: Vec<(&'static str, f64)> = Vec::new();
    for Span { kernel, begin, end } in spans {
        let milliseconds = 1.0e3 * (end - begin) / repeats;
        match kernels.iter_mut().find(|(name, _)| name == kernel) {
            Some((_, sum)) => *sum += milliseconds,
            None => kernels.push((kernel, milliseconds)),
        }
    }
    kernels
}

/// Medians of several measurements; a kernel that one lacks takes nothing there.
fn middle(all: &[Took]) -> Took {
    let mut names: Vec<&'static str> = Vec::new();
    for (name, _) in all.iter().flat_map(|took| &took.kernels) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    let of = |took: &Took, name| took.kernels.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, time)| *time);
    let kernel = |name| (name, median(&all.iter().map(|took| of(took, name)).collect::<Vec<_>>()));
    Took {
        milliseconds: median(&all.iter().map(|took| took.milliseconds).collect::<Vec<_>>()),
        kernels: names.into_iter().map(kernel).collect(),
    }
}

/// Seconds of a plan's only pass: the median of as many runs as there is time for.
pub(super) fn pass_seconds(gpu: &mut GpuExecutor, plan: FramePlan<'static>, time: f64) -> Result<f64, Error> {
    let FramePlan { buffers, passes, outputs, .. } = plan;
    let passes = passes.collect::<Result<Vec<_>, _>>()?;
    let mut run = |times: u32| {
        let plan = FramePlan::of(
            buffers.clone(),
            std::iter::repeat_n(passes.clone(), times as usize).flatten().collect(),
            outputs.clone(),
        );
        Ok::<_, Error>(gpu.run_timed(plan)?)
    };
    run(1)?;
    let estimate = run(TRIED)?.seconds / f64::from(TRIED);
    let count = measurements(time, estimate);
    let all = run(count)?;
    let spans: Vec<f64> = all.spans.iter().map(|span| span.end - span.begin).collect();
    Ok(if spans.is_empty() { all.seconds / f64::from(count) } else { median(&spans) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn took(milliseconds: f64, kernels: &[(&'static str, f64)]) -> Took {
        Took { milliseconds, kernels: kernels.to_vec() }
    }

    #[test]
    fn a_kernel_takes_what_its_passes_take() {
        let span = |kernel, begin, end| Span { kernel, begin, end };
        let spans = [span("a", 0.0, 0.25), span("b", 0.25, 0.5), span("a", 1.0, 1.5)];
        assert_eq!(kernels(&spans, 2.0), [("a", 375.0), ("b", 125.0)]);
        let run = of_run(&Timeline { spans: spans.to_vec(), seconds: 9.0 }, 2.0);
        assert_eq!(run.milliseconds, 750.0);
        assert_eq!(of_run(&Timeline { spans: Vec::new(), seconds: 9.0 }, 3.0), took(3000.0, &[]));
    }

    #[test]
    fn medians_are_taken_kernel_by_kernel() {
        let all =
            [took(3.0, &[("a", 1.0), ("b", 2.0)]), took(9.0, &[("a", 5.0)]), took(4.0, &[("b", 4.0), ("a", 2.0)])];
        assert_eq!(middle(&all), took(4.0, &[("a", 2.0), ("b", 2.0)]));
    }

    #[test]
    fn there_are_never_too_few_or_too_many() {
        assert_eq!([1.0e9, 0.2, 1.0e-9].map(|each| measurements(1.0, each)), [1, 5, MOST]);
        assert_eq!(measurements(1.0, 0.9), FEWEST);
    }
}
