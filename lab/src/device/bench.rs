//! The device, and how much of it is measured.

use std::time::{Duration, Instant};

use restir_host::Shaders;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::gpu::takes_passthrough;
use restir_host::exec::{Executor, Flavour, GpuExecutor};
use restir_host::scene::Scene;
use restir_host::wgpu::DeviceType;

use super::Extent;
use super::subjects::MAIN;
use crate::Error;

/// Width and height of the images that are checked when a device is opened.
const CHECKED: [u32; 2] = [16, 16];

/// An adapter with the kernels of each flavour that it can have.
pub(super) struct Bench {
    pub(super) extent: Extent,
    executors: Vec<(Flavour, GpuExecutor)>,
}

/// Time that a part may take; what it has begun it ends.
pub(super) struct Budget {
    end: Instant,
}

impl Budget {
    pub(super) fn is_over(&self) -> bool {
        Instant::now() >= self.end
    }
}

impl Bench {
    pub(super) fn open(adapter: Option<&str>, extent: Extent) -> Result<Self, Error> {
        let scene = SceneBuffers::build(&Scene::load(MAIN[0].scene)?)?;
        let render = MAIN[0].render(CHECKED)?;
        let open =
            |flavour| GpuExecutor::builder().adapter(adapter).flavour(flavour).for_render(&scene, &render).open();
        let fast = open(Flavour::Fast)?;
        let exact = takes_passthrough(fast.device()).then(|| fast.reload(Flavour::Exact, Shaders::Embedded));
        let exact = exact.map(|exact| (Flavour::Exact, exact));
        Ok(Self { extent, executors: exact.into_iter().chain([(Flavour::Fast, fast)]).collect() })
    }

    /// The device's kernels by flavour, exact ones first, where they can be had.
    pub(super) fn executors(&mut self) -> &mut [(Flavour, GpuExecutor)] {
        &mut self.executors
    }

    /// The flavour that is compared with the host and measured where one is enough: exact, if it can be had.
    pub(super) fn main(&mut self) -> &mut GpuExecutor {
        &mut self.executors[0].1
    }

    /// The kernels whose words are the host's, if the adapter can have them.
    pub(super) fn exact(&mut self) -> Option<&mut GpuExecutor> {
        self.executors.iter_mut().find(|(flavour, _)| *flavour == Flavour::Exact).map(|(_, gpu)| gpu)
    }

    pub(super) fn device(&self) -> &GpuExecutor {
        &self.executors[0].1
    }

    /// Whether the adapter has no hardware of its own.
    pub(super) fn is_software(&self) -> bool {
        self.device().device().adapter_info().device_type == DeviceType::Cpu
    }

    /// The adapter's name alone.
    pub(super) fn adapter(&self) -> String {
        self.device().device().adapter_info().name
    }

    /// The adapter with its driver.
    pub(super) fn description(&self) -> String {
        self.device().describe().adapter.unwrap_or_default()
    }

    /// Width and height of images.
    pub(super) fn size(&self) -> [u32; 2] {
        if self.extent == Extent::Quick { [64, 48] } else { [1920, 1080] }
    }

    /// Time for a part of which as much is measured as there is time for.
    pub(super) fn budget(&self) -> Budget {
        let seconds = match self.extent {
            Extent::Quick => 60,
            Extent::Turn => 40,
            Extent::Full => 120,
        };
        Budget { end: Instant::now() + Duration::from_secs(seconds) }
    }

    /// Seconds for one figure, without what warms up.
    pub(super) fn figure_seconds(&self) -> f64 {
        match self.extent {
            Extent::Quick => 0.1,
            Extent::Turn => 0.5,
            Extent::Full => 1.0,
        }
    }
}
