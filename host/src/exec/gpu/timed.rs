//! Passes by the device's own clock, with no wait between them.

use super::{GpuExecutor, allocate, dispatch, guarded};
use crate::Error;
use crate::plan::{FramePlan, Pass};
use std::time::Instant;

/// Passes of a submission: enough that the device always has work, and few enough that a driver with a time limit lets them pass.
const TOGETHER: usize = 32;

/// When the device ran a pass, in seconds after the plan's first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Name of the kernel.
    pub kernel: &'static str,
    /// When it began.
    pub begin: f64,
    /// When it ended.
    pub end: f64,
}

/// What a plan takes.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Of each pass, in order; none on a device without a clock ([`GpuExecutor::has_clock`]).
    pub spans: Vec<Span>,
    /// From the first submission until all is done, in seconds of the host's clock.
    pub seconds: f64,
}

/// A pass that is ready to be recorded.
struct Ready<'a> {
    pass: &'a Pass,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

/// Where the device notes the beginning and end of each pass of a submission.
struct Notes {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
}

impl GpuExecutor {
    /// Whether the device has a clock that passes can ask.
    #[doc(hidden)]
    pub fn has_clock(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Runs a plan as a program would that waits for nothing: pipelines, buffers and bindings are made before its first pass begins, and
    /// passes are submitted many at a time. Its outputs are not read.
    ///
    /// # Errors
    /// As of [`crate::exec::Executor::run`].
    #[doc(hidden)]
    pub fn run_timed(&mut self, plan: FramePlan<'_>) -> Result<Timeline, Error> {
        let buffers = allocate(&self.device, &plan.buffers)?;
        let passes = plan.passes.collect::<Result<Vec<Pass>, Error>>()?;
        passes.iter().try_for_each(|pass| pass.check(&plan.buffers))?;
        let wanted: Vec<_> = passes.iter().map(|pass| (pass.kernel, pass.constants.clone())).collect();
        self.pipelines.prepare(&wanted, &mut *self.observe_pipelines)?;
        let ready = passes.iter().map(|pass| self.ready(pass, &buffers)).collect::<Result<Vec<_>, Error>>()?;
        let device = self.device.clone();
        guarded(&device, || {
            // contents of buffers are on their way until then
            self.queue.submit([]);
            self.wait()?;
            let begun = Instant::now();
            let notes: Vec<Option<Notes>> =
                submissions(&ready).map(|some| self.submit_together(some, &buffers)).collect();
            self.wait()?;
            let seconds = begun.elapsed().as_secs_f64();
            let mut first = None;
            let spans =
                submissions(&ready).zip(&notes).map(|(some, notes)| self.spans(some, notes.as_ref(), &mut first));
            Ok(Timeline { spans: spans.collect::<Result<Vec<_>, Error>>()?.concat(), seconds })
        })
    }

    fn ready<'a>(&mut self, pass: &'a Pass, buffers: &[wgpu::Buffer]) -> Result<Ready<'a>, Error> {
        let pipeline = self.pipelines.get(pass.kernel, &pass.constants)?;
        let group = guarded(&self.device, || Ok(self.group(pass, &pipeline, buffers)))?;
        Ok(Ready { pass, pipeline, group })
    }

    /// Submits passes of which only the first may begin a frame that differs in buffers.
    fn submit_together(&self, some: &[Ready<'_>], buffers: &[wgpu::Buffer]) -> Option<Notes> {
        some.iter().for_each(|ready| self.upload(ready.pass, buffers));
        let notes = self.has_clock().then(|| self.notes(some.len() as u32));
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (index, Ready { pass, pipeline, group }) in (0..).zip(some) {
            let timestamp_writes = notes.as_ref().map(|notes| wgpu::ComputePassTimestampWrites {
                query_set: &notes.queries,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            });
            let descriptor = wgpu::ComputePassDescriptor { label: Some(pass.kernel.name), timestamp_writes };
            dispatch(&mut encoder.begin_compute_pass(&descriptor), pass, pipeline, group);
        }
        if let Some(Notes { queries, resolved }) = &notes {
            encoder.resolve_query_set(queries, 0..2 * some.len() as u32, resolved, 0);
        }
        self.queue.submit([encoder.finish()]);
        notes
    }

    fn notes(&self, passes: u32) -> Notes {
        let queries = self.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("clock"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * passes,
        });
        let resolved = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("clock"),
            size: u64::from(2 * passes) * u64::from(wgpu::QUERY_SIZE),
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Notes { queries, resolved }
    }

    /// When passes of a submission ran, after the first tick of all, which is `begun`.
    fn spans(&self, some: &[Ready<'_>], notes: Option<&Notes>, begun: &mut Option<u64>) -> Result<Vec<Span>, Error> {
        let Some(notes) = notes else { return Ok(Vec::new()) };
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&self.read(&notes.resolved)?);
        let begun = *begun.get_or_insert(ticks[0]);
        // a clock may have counted for years, and a difference has more digits
        let seconds =
            |ticks: u64| ticks.saturating_sub(begun) as f64 * f64::from(self.queue.get_timestamp_period()) * 1.0e-9;
        let span = |(ready, ticks): (&Ready<'_>, &[u64])| Span {
            kernel: ready.pass.kernel.name,
            begin: seconds(ticks[0]),
            end: seconds(ticks[1]),
        };
        Ok(some.iter().zip(ticks.chunks_exact(2)).map(span).collect())
    }
}

/// Passes by submission. What a frame differs in is written before a submission, so that such a frame begins one.
fn submissions<'a>(ready: &'a [Ready<'a>]) -> impl Iterator<Item = &'a [Ready<'a>]> {
    ready.chunk_by(|_, next| next.pass.frame.is_none()).flat_map(|frame| frame.chunks(TOGETHER))
}
