//! An executor that takes the time of every pass.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::time::Instant;

use restir::Error;
use restir::advanced::plan::FramePlan;
use restir::exec::{Description, Dispatches, Executor, Observer};

/// What the passes of one kernel took together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PassTime {
    pub(crate) dispatches: u64,
    pub(crate) seconds: f64,
}

/// Runs plans on another executor. A pass takes from the end of the one before to its own, as the observer hears it.
pub(crate) struct Timed<'a> {
    pub(crate) inner: &'a mut dyn Executor,
    /// To which they add.
    pub(crate) passes: &'a mut BTreeMap<&'static str, PassTime>,
}

impl Executor for Timed<'_> {
    fn describe(&self) -> Description {
        self.inner.describe()
    }

    fn dispatches(&self) -> Dispatches {
        self.inner.dispatches()
    }

    fn run_observed(&mut self, plan: FramePlan<'_>, observe: &mut Observer<'_>) -> Result<Vec<Vec<u32>>, Error> {
        let started = Cell::new(None);
        let begun = plan.passes.inspect(|_| started.set(started.get().or_else(|| Some(Instant::now()))));
        let plan = FramePlan { passes: Box::new(begun), ..plan };
        self.inner.run_observed(plan, &mut |step| {
            let now = Instant::now();
            if let Some(start) = started.replace(Some(now)) {
                let time = self.passes.entry(step.pass.kernel.name).or_default();
                time.dispatches += 1;
                time.seconds += now.duration_since(start).as_secs_f64();
            }
            observe(step)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::render::Render;
    use restir::{buffers::SceneBuffers, exec::CpuExecutor, scene::Scene, technique::path::PathSettings};

    #[test]
    fn every_pass_is_counted_and_the_image_is_the_same() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let path = PathSettings { dispatch_samples: Some(2), ..PathSettings::default() };
        let settings = Render { count: 5, ..Render::new([8, 8], path) };
        let mut cpu = CpuExecutor::with_threads(1).unwrap();
        let plain = settings.render(&scene, &mut cpu).unwrap();
        let mut passes = BTreeMap::new();
        let mut timed = Timed { inner: &mut cpu, passes: &mut passes };
        let rendered = settings.render(&scene, &mut timed).unwrap();
        assert_eq!(rendered.image, plain.image);
        let dispatches = |name: &str| passes.get(name).map(|time| time.dispatches);
        assert_eq!(["path", "film_add", "film_resolve"].map(dispatches), [Some(3), Some(2), Some(1)]);
    }
}
