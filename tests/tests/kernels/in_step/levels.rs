//! Films by the instructions of every level, with and without lanes.

use libtest_mimic::Failed;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::technique;
use restir_kernels::{Avx2, Avx512, SimdLevel};
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
        for level in SimdLevel::available() {
            ensure(film(level)? == portable, || format!("{technique} of {name} has other bits at {level:?}"))?;
            let by_pixel = CpuExecutor::inline().with_level(level).without_lanes().run(render.plan(&scene))?;
            ensure(by_pixel == portable, || {
                format!("{technique} of {name} has other bits at {level:?}, pixel by pixel")
            })?;
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
