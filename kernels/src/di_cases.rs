//! Parity cases of the kernels of ReSTIR DI: a short chain of passes, run natively, whose planes the kernels are given.

use crate::{Case, CaseScene, CaseScenes};
use restir_shared::glam::UVec4;
use restir_shared::layout::{FEATURES_ALL, FilmPixel};
use restir_shared::resample::mis::Mis;
use restir_shared::scene::SceneView;
use restir_shared::technique::di;
use restir_shared::technique::di::{
    DI_AVERAGE_VISIBILITY, DI_FINAL_RAY, DI_INITIAL_VISIBILITY, DI_JITTER, DI_MIS_SHIFT, DI_MIS_VISIBILITY,
    DI_OTHER_FRAME, DI_SCATTER_CANDIDATE, DI_STILL, DI_TARGET_VISIBILITY, DI_TILES, DI_TRANSMITTANCE, DiPairs,
    DiParams, DiPoint, PAIRS, TileWords,
};

const WIDTH: u32 = 20;
const HEIGHT: u32 = 14;

/// The planes of two frames.
pub(crate) struct Chain {
    pub(crate) params: DiParams,
    pub(crate) hits: [Vec<UVec4>; 2],
    pub(crate) reservoirs: [Vec<UVec4>; 2],
    pub(crate) direct: Vec<FilmPixel>,
    /// Candidates of the second frame.
    pub(crate) tiles: Vec<TileWords>,
    /// What its pixels show their neighbours in shading.
    pub(crate) points: Vec<DiPoint>,
    pairs: Vec<DiPairs>,
    sent: Vec<FilmPixel>,
}

/// Visibility where the reservoirs of initial samples lack what is occluded.
const REUSE: u32 = DI_INITIAL_VISIBILITY | DI_MIS_VISIBILITY;

/// Name, scene, flags, form of MIS, neighbours.
const ROWS: [(&str, &str, u32, Mis, u32); 22] = [
    ("1/M, temporal", "cornell", DI_OTHER_FRAME | DI_INITIAL_VISIBILITY | DI_FINAL_RAY, Mis::ONE_OVER_M, 0),
    ("1/Z, spatial", "cornell", REUSE | DI_FINAL_RAY, Mis::ONE_OVER_Z, 4),
    ("contribution, temporal", "many-lights", DI_OTHER_FRAME | REUSE | DI_JITTER, Mis::CONTRIBUTION, 0),
    ("contribution, spatial", "glossy", REUSE | DI_TARGET_VISIBILITY | DI_SCATTER_CANDIDATE, Mis::CONTRIBUTION, 3),
    ("talbot, spatial", "cornell", REUSE | DI_FINAL_RAY | DI_SCATTER_CANDIDATE, Mis::TALBOT, 4),
    ("talbot, averaged", "many-lights", DI_INITIAL_VISIBILITY | DI_AVERAGE_VISIBILITY, Mis::TALBOT, 1),
    ("talbot, averaged in time", "cornell", DI_OTHER_FRAME | DI_AVERAGE_VISIBILITY | DI_JITTER, Mis::TALBOT, 0),
    ("pairwise, both at once", "tower", DI_OTHER_FRAME | REUSE | DI_TARGET_VISIBILITY, Mis::PAIRWISE, 4),
    ("defensive, spatial", "glass", REUSE | DI_TARGET_VISIBILITY | DI_SCATTER_CANDIDATE, DEFENSIVE, 5),
    ("counted, spatial", "tower", DI_FINAL_RAY | DI_SCATTER_CANDIDATE, Mis::PAIRWISE_COUNTED, 7),
    ("counted, defensive", "cornell", REUSE | DI_TARGET_VISIBILITY, Mis::PAIRWISE_COUNTED.with(Mis::DEFENSIVE), 5),
    ("constant, a still view", "cornell", DI_OTHER_FRAME | DI_STILL | REUSE | DI_TARGET_VISIBILITY, Mis::CONSTANT, 0),
    ("constant, no light", "empty", DI_FINAL_RAY | DI_SCATTER_CANDIDATE, Mis::CONSTANT, 2),
    ("tiles", "many-lights", DI_TILES | REUSE | DI_TARGET_VISIBILITY | DI_SCATTER_CANDIDATE, DEFENSIVE, 3),
    ("tiles of all kinds of lights", "tower", DI_TILES | REUSE | DI_SCATTER_CANDIDATE, Mis::TALBOT, 2),
    ("tiles, no light", "empty", DI_TILES | DI_FINAL_RAY, Mis::CONSTANT, 2),
    ("defensive, as lights go out", "moving 5", DI_OTHER_FRAME | REUSE | DI_TARGET_VISIBILITY, DEFENSIVE, 3),
    ("1/Z, as lights come back", "moving 9", DI_OTHER_FRAME | REUSE | DI_SCATTER_CANDIDATE, Mis::ONE_OVER_Z, 2),
    ("through glass, by a final ray", "panes", DI_TRANSMITTANCE | DI_FINAL_RAY, Mis::TALBOT, 3),
    ("through glass, averaged", "panes", DI_TRANSMITTANCE | DI_AVERAGE_VISIBILITY, Mis::PAIRWISE, 3),
    ("through glass, averaged in time", "panes", TINTED | DI_AVERAGE_VISIBILITY | DI_OTHER_FRAME, Mis::TALBOT, 0),
    ("through glass, selected", "panes", TINTED | REUSE | DI_TARGET_VISIBILITY | DI_SCATTER_CANDIDATE, DEFENSIVE, 4),
];

const TINTED: u32 = DI_TRANSMITTANCE | DI_INITIAL_VISIBILITY;
const DEFENSIVE: Mis = Mis::PAIRWISE.with(Mis::DEFENSIVE);

/// The cases of a kernel: `add` gives one its planes, after the parameters and the scene. Each runs as the general kernel
/// and, some, as the one frozen to scene and settings.
pub(crate) fn make(scenes: &dyn CaseScenes, add: impl Fn(&Chain, Case) -> Case) -> Vec<Case> {
    make_with(scenes, |_| {}, add)
}

/// As [`make`], of a kernel of shading.
pub(crate) fn make_within_frame(scenes: &dyn CaseScenes, add: impl Fn(&Chain, Case) -> Case) -> Vec<Case> {
    make_with(scenes, |params| *params = within_frame(params), add)
}

/// The cases of what gathers: it reads no scene.
pub(crate) fn gathered(scenes: &dyn CaseScenes) -> Vec<Case> {
    let of_row = |(name, scene_name, flags, mis, neighbours)| {
        let (_, chain) = row(scenes, scene_name, flags, mis, neighbours);
        Case::new(format!("{name}, {scene_name}"), WIDTH, HEIGHT)
            .with(&[within_frame(&chain.params)])
            .with(&chain.points)
            .with(&chain.pairs)
            .with(&chain.direct)
            .with(&chain.sent)
    };
    ROWS.map(of_row).into()
}

/// Parameters of shading.
fn within_frame(params: &DiParams) -> DiParams {
    let mut pairs = [0; PAIRS];
    let count = di::pair_offsets(params.seed, params.frame, params.radius, &mut pairs) as u32;
    let neighbours = 2 * if params.neighbours < count { params.neighbours } else { count };
    let shading_pass = params.neighbours % 3;
    DiParams { flags: params.flags & !DI_OTHER_FRAME, neighbours, shading_pass, pairs, ..*params }
}

fn row(scenes: &dyn CaseScenes, scene_name: &str, flags: u32, mis: Mis, neighbours: u32) -> (CaseScene, Chain) {
    let is_empty = scene_name == "empty";
    let scene = scenes.scene(if is_empty { "cornell" } else { scene_name });
    let chain = chain(&scene, flags | (mis.0 << DI_MIS_SHIFT), neighbours, is_empty);
    (scene, chain)
}

/// As [`make`], with other parameters for the kernel than for the chain.
fn make_with(scenes: &dyn CaseScenes, adjust: impl Fn(&mut DiParams), add: impl Fn(&Chain, Case) -> Case) -> Vec<Case> {
    let mut cases = Vec::new();
    for (index, (name, scene_name, flags, mis, neighbours)) in ROWS.into_iter().enumerate() {
        let (scene, mut chain) = row(scenes, scene_name, flags, mis, neighbours);
        adjust(&mut chain.params);
        let frozen = [scene.features, chain.params.flags];
        let both: &[[u32; 2]] = if index % 4 == 3 { &[[FEATURES_ALL; 2], frozen] } else { &[[FEATURES_ALL; 2]] };
        for &[features, settings] in both {
            let kind = if features == FEATURES_ALL { "general" } else { "frozen" };
            let case = Case::new(format!("{name}, {scene_name}, {kind}"), WIDTH, HEIGHT)
                .freeze(0, features)
                .freeze(1, settings)
                .with(&[chain.params])
                .with(&scene.geometry)
                .with(&scene.attributes)
                .with(&scene.texels);
            cases.push(add(&chain, case));
        }
    }
    cases
}

/// Two frames of initial reservoirs; the camera moves in between, and what moves in the scene. The parameters are those of the second frame's combine.
fn chain(scene: &CaseScene, flags: u32, neighbours: u32, lightless: bool) -> Chain {
    let mut headers = [scene.other_header, scene.header];
    if lightless {
        headers.iter_mut().for_each(|header| header.light_count = 0);
    }
    let view = |frame: u32| -> SceneView<'_> {
        SceneView {
            header: headers[frame as usize],
            geometry: bytemuck::cast_slice(&scene.geometry),
            attributes: bytemuck::cast_slice(&scene.attributes),
            texels: bytemuck::cast_slice(&scene.texels),
            features: FEATURES_ALL,
            tracer: None,
        }
    };
    let before = (scene.camera)(WIDTH, HEIGHT);
    let mut camera = before;
    for (position, right) in camera.position.iter_mut().zip(before.right) {
        *position += 0.05 * right;
    }
    let of_frame = |frame: u32| DiParams {
        scene: headers[frame as usize],
        other_scene: headers[frame as usize],
        camera: if frame == 0 { before } else { camera },
        other_camera: if frame == 0 { before } else { camera },
        width: WIDTH,
        height: HEIGHT,
        frame,
        other_frame: frame,
        seed: 5,
        flags,
        candidates: 8,
        neighbours,
        combine: 1,
        confidence_cap: 20.0,
        radius: 6.0,
        near_radius: 2.0,
        max_plane_distance: 0.05,
        min_normal_cos: 0.5,
        shading_pass: 0,
        group: 5,
        tiles: 3,
        tile_size: 50,
        reserved: [0; 2],
        pairs: [0; PAIRS],
    };
    let pixels = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| [x, y]));
    let hits: [Vec<UVec4>; 2] =
        [0, 1].map(|frame| pixels().map(|at| di::primary(&view(frame), &of_frame(frame), flags, at)).collect());
    let tiles = |frame: u32| -> Vec<TileWords> {
        let params = of_frame(frame).tile_params();
        let places = (0..params.tiles).flat_map(|tile| (0..params.tile_size).map(move |index| (index, tile)));
        places.map(|(index, tile)| di::presample(&view(frame), &params, index, tile)).collect()
    };
    let initial = |frame: u32| -> Vec<(UVec4, FilmPixel)> {
        let tiles = tiles(frame);
        let tiles = bytemuck::cast_slice(&tiles);
        let hits: &Vec<UVec4> = &hits[frame as usize];
        pixels()
            .zip(hits)
            .map(|(at, &hit)| di::initial(&view(frame), &of_frame(frame), flags, tiles, hit, at))
            .collect()
    };
    let both = [initial(0), initial(1)];
    let reservoirs: [Vec<UVec4>; 2] =
        [0, 1].map(|frame: usize| both[frame].iter().map(|(reservoir, _)| *reservoir).collect());
    let direct = both[1].iter().map(|(_, direct)| *direct).collect();
    let other_frame = if flags & DI_OTHER_FRAME != 0 { 0 } else { 1 };
    let DiParams { scene: other_scene, camera: other_camera, .. } = of_frame(other_frame);
    let params = DiParams { other_scene, other_camera, other_frame, ..of_frame(1) };
    let shading = within_frame(&params);
    let (now, shading_flags): ([&Vec<UVec4>; 2], u32) = ([&hits[1], &reservoirs[1]], shading.flags);
    let seen = || pixels().zip(now[0].iter().zip(now[1])).map(|(at, (&hit, &reservoir))| (at, [hit, reservoir]));
    let points: Vec<DiPoint> =
        seen().map(|(at, words)| di::offer(view(1), &shading, shading_flags, words, at)).collect();
    let (pairs, sent) =
        seen().map(|(at, [hit, _])| di::exchange(view(1), &shading, shading_flags, &points, hit, at)).unzip();
    Chain { params, hits, reservoirs, direct, tiles: tiles(1), points, pairs, sent }
}
