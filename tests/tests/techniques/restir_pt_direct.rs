//! ReSTIR PT with direct light by another technique: the picture is that of path tracing, and nothing is in it twice.

use libtest_mimic::Failed;
use restir_host::plan::Pass;
use restir_host::render::Render;
use restir_kernels::restir_pt::pt_trace;
use restir_shared::resample::params::Flags;
use restir_shared::technique::restir_di::DiParams;
use restir_shared::technique::restir_pt::PtParams;
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::native::{changed, edit, film, plan};
use restir_tests::scenes::{buffers, path_params};
use restir_tests::stats::effort::draws;
use restir_tests::stats::{FAMILY_RATE, TileGrid, TileTest};
use restir_tests::technique::Trials;

restir_tests::suite! {
    later {
        direct_light_by_another_technique_keeps_the_mean direct_light_counted_twice_is_seen
        light_behind_clear_glass_counted_twice_is_seen
    }
}

const GRID: TileGrid = TileGrid { width: 24, height: 24, tile: 8 };
const SETTINGS: &str = "direct=restir-di,tile=4,max_plane_distance=0.1,max_depth=5";
const DEPTH: u32 = 5;
const FRAMES: u32 = 3;
const REFERENCE_SAMPLES: u32 = 2048;
/// Seeds of the reference lie beyond those of the chains.
const REFERENCE_SEED: u32 = 1 << 31;

/// The last frame of independent chains, against path tracing.
fn against_path_tracing(scene: &str, restarts: u32, change: fn(&mut Pass), biased: bool) -> Result<(), Failed> {
    let buffers = buffers(scene)?;
    let size = [GRID.width, GRID.height];
    let mut params = path_params(&buffers, size, DEPTH);
    params.seed = REFERENCE_SEED;
    let reference = path_moments(GRID, draws(REFERENCE_SAMPLES), &buffers.traced_view(), params);
    let technique = Trials::of("restir-pt")?.with(SETTINGS)?;
    let chains = film_moments(GRID, restarts, |seed| {
        let render = Render { count: FRAMES, seed, ..Render::new(size, technique.clone()) };
        film(changed(plan(&buffers, &render), change))
    })?;
    let verdict = TileTest { grid: GRID, family_rate: FAMILY_RATE }.compare(&chains, &reference);
    if biased { ensure_biased(scene, &verdict) } else { ensure_unbiased(scene, &verdict, f64::INFINITY) }
}

fn direct_light_by_another_technique_keeps_the_mean() -> Result<(), Failed> {
    ["cornell", "glass", "tower", "all-lights"]
        .into_iter()
        .try_for_each(|scene| against_path_tracing(scene, 128, |_| (), false))
}

fn direct_light_counted_twice_is_seen() -> Result<(), Failed> {
    let twice = |pass: &mut Pass| {
        if pass.kernel.name == pt_trace::DESC.name {
            edit(pass, |params: &mut PtParams| params.flags = params.flags.without(Flags::INDIRECT_ONLY));
        }
    };
    against_path_tracing("cornell", 32, twice, true)
}

/// Direct light that sees through clear glass finds what is a longer path here.
fn light_behind_clear_glass_counted_twice_is_seen() -> Result<(), Failed> {
    let through = |pass: &mut Pass| {
        if pass.kernel.name.starts_with("di_") {
            edit(pass, |params: &mut DiParams| params.flags = params.flags | Flags::TRANSMITTANCE);
        }
    };
    against_path_tracing("panes", 64, through, true)?;
    against_path_tracing("panes", 64, |_| (), false)
}
