//! Films by the instructions of every level, with and without lanes.

use libtest_mimic::Failed;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{FramePlan, Pass};
use restir_host::render::Render;
use restir_host::technique;
use restir_kernels::path::path;
use restir_kernels::{Access, Avx2, Avx512, KernelDesc, NativeRow, SimdLevel};
use restir_tests::scenes::buffers;
use restir_tests::suite::ensure;

use super::SIZE;

/// Techniques with kernels that have a form for lanes.
const TECHNIQUES: [&str; 2] = ["path", "restir-di"];

/// The films of a scene at a level are those of the portable one.
pub(super) fn same_films(name: &str) -> Result<(), Failed> {
    let scene = buffers(name)?;
    for technique in TECHNIQUES {
        let render = Render { count: 3, ..Render::new(SIZE, technique::named(technique)?) };
        let film = |level| CpuExecutor::inline().with_level(level).run(render.plan(&scene));
        let portable = film(SimdLevel::Portable)?;
        for level in SimdLevel::available().into_iter().filter(|&level| level != SimdLevel::Portable) {
            ensure(film(level)? == portable, || format!("{technique} of {name} has other bits at {level:?}"))?;
            let by_pixel = CpuExecutor::inline().with_level(level).without_lanes().run(render.plan(&scene))?;
            ensure(by_pixel == portable, || {
                format!("{technique} of {name} has other bits at {level:?}, pixel by pixel")
            })?;
        }
    }
    Ok(())
}

/// Stands for the kernel `path`: it writes down the level of its rows.
fn write_level(row: &mut NativeRow<'_>) {
    let level = row.lanes as u32;
    row.own.iter_mut().for_each(|own| own.fill(level));
}
static LEVEL: KernelDesc = KernelDesc { native: write_level, ..path::DESC };

/// Rows are given the level that an executor was asked for, in whichever order, or without lanes the portable one.
pub(super) fn as_asked() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let render = Render { count: 1, ..Render::new([4, 4], technique::named("path")?) };
    let told = |mut cpu: CpuExecutor| {
        let plan = render.plan(&scene);
        let stands = |pass: Pass| if pass.kernel.name == LEVEL.name { Pass { kernel: &LEVEL, ..pass } } else { pass };
        let mut seen = Vec::new();
        let plan = FramePlan { passes: Box::new(plan.passes.map(|pass| pass.map(stands))), ..plan };
        cpu.run_observed(plan, &mut |step| {
            let own = step.pass.bindings().filter(|(binding, _)| binding.access == Access::Own);
            for (_, buffer) in own.filter(|_| step.pass.kernel.name == LEVEL.name) {
                seen.extend(step.read(buffer)?);
            }
            Ok(())
        })?;
        Ok::<_, Failed>(seen)
    };
    for level in SimdLevel::available() {
        for (cpu, expected) in [
            (CpuExecutor::inline().with_level(level), level),
            (CpuExecutor::inline().with_level(level).without_lanes(), SimdLevel::Portable),
            (CpuExecutor::inline().without_lanes().with_level(level), SimdLevel::Portable),
        ] {
            let told = told(cpu)?;
            let right = !told.is_empty() && told.iter().all(|&told| told == expected as u32);
            ensure(right, || format!("rows are told {told:?} and not {expected:?}"))?;
        }
    }
    Ok(())
}

/// Levels are in order, those that the processor lacks stand for lower ones, and each has its own token.
pub(super) fn in_order() -> Result<(), Failed> {
    let levels = SimdLevel::available();
    ensure(levels.is_sorted() && levels.first() == Some(&SimdLevel::Portable), || format!("{levels:?}"))?;
    ensure(levels.last() == Some(&SimdLevel::best()), || format!("{:?} of {levels:?}", SimdLevel::best()))?;
    for level in [SimdLevel::Avx2, SimdLevel::Avx512].into_iter().filter(|level| !levels.contains(level)) {
        ensure(level.or_below() == SimdLevel::best(), || format!("{level:?} stands for {:?}", level.or_below()))?;
    }
    for level in levels {
        ensure(level.or_below() == level, || format!("{level:?} stands for {:?}", level.or_below()))?;
        let tokens = [Avx2::at(level).is_some(), Avx512::at(level).is_some()];
        let expected = [SimdLevel::Avx2, SimdLevel::Avx512].map(|own| own == level);
        ensure(tokens == expected, || format!("{level:?} has the tokens {tokens:?}"))?;
    }
    Ok(())
}
