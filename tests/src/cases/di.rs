//! Rows of ReSTIR DI: all forms of MIS and uses of visibility, in time, in space and both at once.

use super::{of_row, scene};
use glam::DVec3;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::di::{DiRender, DiSettings, MisForm, Visibility, plan};
use restir_host::scene::Camera;
use restir_kernels::Case;

const SIZE: [u32; 2] = [20, 14];
/// Of these rows one has frozen cases as well: they take another compilation each.
const FROZEN_EVERY: usize = 4;

/// Name, scene, frames, settings. The camera steps aside before the last frame, unless the settings are for a still view.
type Row = (&'static str, &'static str, u32, DiSettings);

/// What is known of visibility.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Known {
    /// Nothing before shading.
    Nothing,
    /// Occluded initial samples count for nothing.
    Initial,
    /// MIS weights have it as well.
    Mis,
    /// Samples are selected by it, too.
    Target,
}

/// One frame for itself.
fn alone(mis: MisForm, known: Known) -> DiSettings {
    DiSettings {
        mis,
        candidates: 8,
        initial_rays: 2,
        scatter: false,
        temporal: false,
        still: false,
        spatial: 0,
        radius: 6.0,
        near_radius: 2.0,
        shading_radius: 6.0,
        max_plane_distance: 0.05,
        initial_visibility: known >= Known::Initial,
        mis_visibility: known >= Known::Mis,
        target_visibility: known >= Known::Target,
        visibility: Visibility::Selected,
        ..DiSettings::default()
    }
}

fn in_time(mis: MisForm, known: Known) -> DiSettings {
    DiSettings { temporal: true, ..alone(mis, known) }
}

fn in_space(mis: MisForm, known: Known, neighbours: u32) -> DiSettings {
    DiSettings { spatial: 1, neighbours, ..alone(mis, known) }
}

fn at_once(mis: MisForm, known: Known, neighbours: u32) -> DiSettings {
    DiSettings { temporal: true, fused: true, ..in_space(mis, known, neighbours) }
}

fn with_tiles(settings: DiSettings) -> DiSettings {
    DiSettings { tiles: 3, tile_size: 50, ..settings }
}

fn rows() -> Vec<Row> {
    use Known::{Initial, Mis, Nothing, Target};
    use MisForm::{
        Constant, Contribution, OneOverM, OneOverZ, Pairwise, PairwiseCounted, PairwiseCountedDefensive,
        PairwiseDefensive, Talbot,
    };
    let ray = |settings| DiSettings { visibility: Visibility::Ray, ..settings };
    let averaged = |settings| DiSettings { visibility: Visibility::Averaged, ..settings };
    let scattered = |settings| DiSettings { scatter: true, ..settings };
    let jittered = |settings| DiSettings { jitter: true, ..settings };
    vec![
        ("1/M, temporal", "cornell", 2, ray(in_time(OneOverM, Initial))),
        ("1/Z, spatial", "cornell", 2, ray(in_space(OneOverZ, Mis, 4))),
        ("contribution, temporal", "many-lights", 2, jittered(in_time(Contribution, Mis))),
        ("contribution, spatial", "glossy", 2, scattered(in_space(Contribution, Target, 3))),
        ("talbot, spatial", "cornell", 2, ray(scattered(in_space(Talbot, Mis, 4)))),
        ("talbot, averaged", "many-lights", 2, averaged(in_space(Talbot, Initial, 1))),
        ("talbot, averaged in time", "cornell", 2, averaged(jittered(in_time(Talbot, Nothing)))),
        ("pairwise, both at once", "tower", 2, at_once(Pairwise, Target, 4)),
        ("defensive, spatial", "glass", 2, scattered(in_space(PairwiseDefensive, Target, 5))),
        ("counted, spatial", "tower", 2, ray(scattered(in_space(PairwiseCounted, Nothing, 7)))),
        ("counted, defensive", "cornell", 2, in_space(PairwiseCountedDefensive, Target, 5)),
        ("a still view", "cornell", 2, DiSettings { still: true, ..in_time(Talbot, Target) }),
        ("constant, no light", "unlit", 2, ray(scattered(in_space(Constant, Nothing, 2)))),
        ("tiles", "many-lights", 2, with_tiles(scattered(in_space(PairwiseDefensive, Target, 3)))),
        ("tiles of all kinds of lights", "tower", 2, with_tiles(scattered(in_space(Talbot, Mis, 2)))),
        ("tiles of an environment", "statue", 2, with_tiles(in_time(Talbot, Mis))),
        ("tiles, no light", "unlit", 2, with_tiles(ray(in_space(Constant, Nothing, 2)))),
        ("as lights go out", "moving", 6, at_once(PairwiseDefensive, Target, 3)),
        ("1/Z, as lights come back", "moving", 10, scattered(at_once(OneOverZ, Mis, 2))),
        ("through glass, by a final ray", "panes", 2, ray(in_space(Talbot, Nothing, 3))),
        ("through glass, averaged", "panes", 2, averaged(in_space(Pairwise, Nothing, 3))),
        ("through glass, averaged in time", "panes", 2, averaged(in_time(Talbot, Initial))),
        ("through glass, selected", "panes", 2, scattered(in_space(PairwiseDefensive, Target, 4))),
    ]
}

fn render(scene: &SceneBuffers, frames: u32, settings: DiSettings) -> DiRender {
    let aside = |frame: u32| frame + 1 == frames && !settings.still;
    let step = |frame| scene.camera.position + if aside(frame) { DVec3::X * 0.05 } else { DVec3::ZERO };
    let cameras = (0..frames).map(|frame| Camera { position: step(frame), ..scene.camera }).collect();
    DiRender { frames, seed: 5, cameras, ..DiRender::new(SIZE, settings) }
}

/// Each row is shaded without neighbours and with as many as take two passes.
pub(super) fn cases() -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for (index, (name, scene_name, frames, settings)) in rows().into_iter().enumerate() {
        let scene = scene(scene_name)?;
        let renders = [10, 0].map(|shaded| render(&scene, frames, DiSettings { shaded, ..settings.clone() }));
        let frozen = index % FROZEN_EVERY == FROZEN_EVERY - 1;
        let plans = renders.iter().map(|render| plan(&scene, render));
        cases.extend(of_row(&format!("{name}, {scene_name}"), frozen, plans)?);
    }
    Ok(cases)
}
