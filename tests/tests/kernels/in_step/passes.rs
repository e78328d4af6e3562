//! Camera rays, combines and shading with neighbours of ReSTIR DI by SIMD have the bits of those one by one.

use super::{Any, ROWS, SIZE, by_either, differing};
use libtest_mimic::Failed;
use restir_host::render::Render;
use restir_kernels::restir_di::di_combine;
use restir_shared::glam::{Quat, Vec3};
use restir_shared::lanes::LANES;
use restir_shared::layout::{CameraParams, FEATURES_UNTEXTURED, FilmPixel};
use restir_shared::resample::mis::Mis;
use restir_shared::resample::params::ReuseParams;
use restir_shared::scene::{SceneFrames, SceneView};
use restir_shared::technique::restir_di::{
    DiPairs, DiParams, DiPoint, Flags, LastFrame, PackedHit, PackedReservoir, Planes, Stored, combine, combine_row,
    exchange, exchange_row, initial, offer, primary, primary_row,
};
use restir_tests::capture::{Capture, captured};
use restir_tests::native::plan;
use restir_tests::scenes::buffers;
use restir_tests::suite::ensure;
use restir_tests::technique::restir_di::settings;

/// A frame of the whole image, one by one.
struct Frame {
    params: DiParams,
    hits: Vec<PackedHit>,
    reservoirs: Vec<PackedReservoir>,
    points: Vec<DiPoint>,
}

/// The pixels of the image, row by row.
fn all() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]))
}

impl Frame {
    fn new(view: SceneView<'_>, params: DiParams) -> Self {
        let hits: Vec<_> = all().map(|at| primary(&view, &params, at)).collect();
        let seen = || all().zip(&hits);
        let reservoirs: Vec<_> = seen().map(|(at, &hit)| initial(&view, &params, &[], hit, at).reservoir).collect();
        let point = |((at, &hit), &reservoir)| offer(view, &params, hit, reservoir, at);
        let points = seen().zip(&reservoirs).map(point).collect();
        Self { params, hits, reservoirs, points }
    }

    /// Some rows of the image, whole and in part: where they begin, and which elements of planes they are.
    fn rows() -> impl Iterator<Item = ([u32; 2], std::ops::Range<usize>)> {
        let begins = ROWS.into_iter().flat_map(|y| [0, LANES as u32 + 3].map(|x| [x, y]));
        begins.map(|[x, y]| ([x, y], ((y * SIZE[0] + x) as usize)..((y + 1) * SIZE[0]) as usize))
    }

    /// Words of hits that are others by SIMD.
    fn other_hits<const COMPILED: u32>(&self, view: &SceneView<'_, COMPILED>, params: &DiParams) -> usize {
        let row = |(at, range): (_, std::ops::Range<usize>)| {
            let mut hits = vec![PackedHit::default(); range.len()];
            primary_row(view, params, at, &mut hits, Any::<true>);
            differing(&hits, &self.hits[range])
        };
        Self::rows().map(row).sum()
    }

    /// Words of reservoirs that are others where they are combined by SIMD by `stepped`, and one by one by `params`, with those of the frame before or
    /// with neighbours.
    fn other_combined<const COMPILED: u32>(
        &self,
        frames: [&SceneFrames<'_, COMPILED>; 2],
        before: &Self,
        [params, stepped]: [&DiParams; 2],
    ) -> usize {
        let in_time = params.flags.contains(Flags::OTHER_FRAME);
        let others = if in_time { before } else { self };
        let planes = Planes { hits: &self.hits, other_hits: &others.hits, others: &others.reservoirs };
        let row = |([x, y], range): ([u32; 2], std::ops::Range<usize>)| {
            let own = &self.reservoirs[range];
            let single: Vec<_> =
                (x..).zip(own).map(|(x, &own)| combine(*frames[0], params, &planes, own, [x, y]).reservoir).collect();
            by_either!(token => {
                let mut row = own.to_vec();
                combine_row(frames[1], stepped, &planes, [x, y], &mut row, token);
                differing(&row, &single)
            })
        };
        Self::rows().map(row).sum()
    }

    /// Words of what neighbours send that are others by SIMD, by `stepped`, than one by one, by `params`.
    fn other_sent<const COMPILED: u32>(
        &self,
        view: SceneView<'_, COMPILED>,
        [params, stepped]: [&DiParams; 2],
    ) -> usize {
        let row = |([x, y], range): ([u32; 2], std::ops::Range<usize>)| {
            let hits = &self.hits[range];
            let single = (x..).zip(hits).map(|(x, &hit)| exchange(view, params, &self.points, hit, [x, y]));
            let single = single.map(|made| (made.pairs, made.sent));
            let (single_pairs, single_film): (Vec<_>, Vec<_>) = single.unzip();
            by_either!(token => {
                let mut pairs = vec![DiPairs::default(); hits.len()];
                let mut film = vec![FilmPixel::default(); hits.len()];
                exchange_row(&view, stepped, &self.points, (hits, [x, y]), (&mut pairs, &mut film), token);
                differing(&pairs, &single_pairs) + differing(&film, &single_film)
            })
        };
        Self::rows().map(row).sum()
    }
}

/// Frames whose reservoirs count as many as this have a long history.
const LONG: f32 = 20.0;

/// The camera, moved and turned to the side by some pixels.
fn turned(camera: CameraParams) -> CameraParams {
    let turn = Quat::from_rotation_y(0.06);
    let [forward, right, up] =
        [camera.forward, camera.right, camera.up].map(|v| (turn * Vec3::from_array(v)).to_array());
    let position = (Vec3::from_array(camera.position) + Vec3::from_array(camera.right) * 0.1).to_array();
    CameraParams { position, forward, right, up, ..camera }
}

/// With neighbours by all forms of MIS, with the frame before where it was seen from the same place and from another one, and all uses of visibility.
fn combines(base: DiParams, last: CameraParams) -> Vec<DiParams> {
    let (near, moved) = (base.with_neighbours(0), base.with_last(&LastFrame::of_view(last, false)));
    let uses = Flags::TARGET_VISIBILITY | Flags::MIS_VISIBILITY | Flags::INITIAL_VISIBILITY;
    let unseen =
        DiParams { reuse: ReuseParams { flags: base.flags.without(uses), ..near.reuse }, near_radius: 4.0, ..near };
    let forms = Mis::NAMED.iter().map(|&(_, form)| with_form(near, form));
    let others = [
        base.with_last(&LastFrame::of_view(base.camera, true)),
        moved,
        DiParams { reuse: ReuseParams { neighbours: 3, ..moved.reuse }, ..moved },
        DiParams {
            reuse: ReuseParams { neighbours: 7, ..with_form(moved, Mis::TALBOT).reuse },
            ..with_form(moved, Mis::TALBOT)
        },
        DiParams {
            reuse: ReuseParams { flags: moved.flags.without(Flags::TARGET_VISIBILITY) | Flags::GREEN, ..moved.reuse },
            ..moved
        },
        unseen,
        DiParams { reuse: ReuseParams { flags: unseen.flags | Flags::FINAL_RAY, ..unseen.reuse }, ..unseen },
        DiParams { reuse: ReuseParams { flags: unseen.flags | Flags::AVERAGE_VISIBILITY, ..unseen.reuse }, ..unseen },
    ];
    forms.chain(others).collect()
}

fn with_form(params: DiParams, form: Mis) -> DiParams {
    DiParams { reuse: ReuseParams { flags: params.flags.with_form(form), ..params.reuse }, ..params }
}

/// As many neighbours as a pass has, and few; all uses of visibility.
fn exchanges(base: DiParams) -> [DiParams; 4] {
    let shading = base.with_shading(5.0, 8);
    let unseen = DiParams {
        reuse: ReuseParams { flags: base.flags.without(Flags::MIS_VISIBILITY), ..shading.reuse },
        near_radius: 3.0,
        ..shading
    };
    [
        shading,
        base.with_shading(3.0, 2),
        unseen,
        DiParams { reuse: ReuseParams { flags: unseen.flags | Flags::FINAL_RAY, ..unseen.reuse }, ..unseen },
    ]
}

/// The frame 4, and the one before it, which was seen from elsewhere and has a long history.
fn two_frames(view: SceneView<'_>, camera: CameraParams, more: Flags) -> [Frame; 2] {
    let base = DiParams::new(camera, SIZE, 5);
    let base = DiParams { reuse: ReuseParams { flags: base.flags | more, ..base.reuse }, ..base };
    let [frame, mut before] =
        [(4, camera), (3, turned(camera))].map(|(at, camera)| Frame::new(view, base.of_frame(at, camera)));
    for reservoir in &mut before.reservoirs {
        *reservoir = Stored { confidence: LONG, ..Stored::unpack(*reservoir) }.pack();
    }
    [frame, before]
}

pub(super) fn same_bits(name: &str) -> Result<(), Failed> {
    let scene = buffers(name)?;
    let (view, camera) = (scene.traced_view(), scene.camera.params(SIZE[0], SIZE[1]));
    for jitter in [Flags::default(), Flags::JITTER] {
        let [frame, before] = two_frames(view, camera, jitter);
        of_frame(&frame, &before, view, name)?;
        view.within::<FEATURES_UNTEXTURED>().map_or(Ok(()), |view| of_frame(&frame, &before, view, name))?;
    }
    Ok(())
}

fn of_frame<const COMPILED: u32>(
    frame: &Frame,
    before: &Frame,
    view: SceneView<'_, COMPILED>,
    name: &str,
) -> Result<(), Failed> {
    let none = |differ: usize, what: &str, params: &DiParams| {
        ensure(differ == 0, || format!("{name}: {differ} words of {what} differ, of {params:?}"))
    };
    none(frame.other_hits(&view, &frame.params), "hits", &frame.params)?;
    let frames = SceneFrames { this: view, other: view.header, other_tracer: view.tracer };
    for params in combines(frame.params, before.params.camera) {
        none(frame.other_combined([&frames; 2], before, [&params; 2]), "combined reservoirs", &params)?;
    }
    for params in exchanges(frame.params) {
        none(frame.other_sent(view, [&params; 2]), "what neighbours send", &params)?;
    }
    Ok(())
}

/// Combines of a scene that moves, where the others are of another scene than the pixels: in time, fused with neighbours by each of two forms of
/// MIS. That the others' scene were this one is seen.
pub(super) fn of_two_scenes(name: &str) -> Result<(), Failed> {
    let scene = buffers(name)?;
    let mut seen = 0;
    for text in ["preset=quality", "temporal=fused,neighbours=3", "temporal=fused,neighbours=7,mis=talbot"] {
        let render = Render { count: 4, ..Render::new([SIZE[0] / 2, SIZE[1]], settings(text)) };
        let captures = captured(plan(&scene, &render))?;
        for capture in captures.iter().filter(|capture| capture.pass.kernel.name == di_combine::DESC.name) {
            let [right, wrong] = [false, true].map(|same| combined_otherwise(capture, scene.features, same));
            ensure(right == 0, || format!("{name}, {text}: {right} words of combined reservoirs differ"))?;
            seen += wrong;
        }
    }
    ensure(seen > 100, || format!("{name}: another scene changes {seen} words"))
}

/// Words of a captured combine that are others by SIMD, with the scene of the other frame or with this one in its place.
fn combined_otherwise(capture: &Capture, features: u32, same: bool) -> usize {
    let params: DiParams = capture.params();
    let [geometry, attributes, texels] = ["geometry", "attributes", "texels"].map(|role| capture.plane(role));
    let (geometry, attributes, texels) = (&geometry[..], &attributes[..], &texels[..]);
    let this: SceneView<'_> = SceneView { header: params.scene, geometry, attributes, texels, features, tracer: None };
    let frames: SceneFrames<'_> = SceneFrames { this, other: params.other_scene, other_tracer: None };
    let stepped = SceneFrames { other: if same { params.scene } else { params.other_scene }, ..frames };
    let (hits, other_hits): (Vec<PackedHit>, Vec<PackedHit>) = (capture.plane("hits"), capture.plane("other_hits"));
    let (others, own): (Vec<PackedReservoir>, Vec<PackedReservoir>) =
        (capture.plane("others"), capture.plane("reservoirs"));
    let planes = Planes { hits: &hits, other_hits: &other_hits, others: &others };
    let row = |(y, own): (u32, &[PackedReservoir])| {
        let single = (0..).zip(own).map(|(x, &own)| combine(frames, &params, &planes, own, [x, y]).reservoir);
        let single: Vec<_> = single.collect();
        by_either!(token => {
            let mut row = own.to_vec();
            combine_row(&stepped, &params, &planes, [0, y], &mut row, token);
            differing(&row, &single)
        })
    };
    (0..).zip(own.chunks(params.width as usize)).map(row).sum()
}

/// Words of combined reservoirs that are others where the history of glossy surfaces does not fade.
fn without_fading() -> Result<usize, Failed> {
    let scene = buffers("glossy")?;
    let (view, camera) = (scene.traced_view(), scene.camera.params(SIZE[0], SIZE[1]));
    let [frame, before] = two_frames(view, camera, Flags::default());
    let frames = SceneFrames { this: view, other: view.header, other_tracer: view.tracer };
    let moved = frame.params.with_last(&LastFrame::of_view(before.params.camera, false));
    Ok(frame.other_combined([&frames; 2], &before, [&moved, &DiParams { gloss_fade: 0.0, ..moved }]))
}

/// Of each pass, that it has other parameters is seen.
pub(super) fn others_are_seen() -> Result<(), Failed> {
    let scene = buffers("many-lights")?;
    let (view, camera) = (scene.traced_view(), scene.camera.params(SIZE[0], SIZE[1]));
    let [frame, before] = two_frames(view, camera, Flags::default());
    let frames = SceneFrames { this: view, other: view.header, other_tracer: view.tracer };
    let moved = frame.params.with_last(&LastFrame::of_view(before.params.camera, false));
    let shading = frame.params.with_shading(5.0, 8);
    let count = Frame::rows().map(|(_, range)| range.len()).sum::<usize>();
    let seen = [
        ("another view", frame.other_hits(&view, &before.params)),
        (
            "a smaller cap",
            frame.other_combined(
                [&frames; 2],
                &before,
                [&moved, &DiParams { reuse: ReuseParams { confidence_cap: 0.5, ..moved.reuse }, ..moved }],
            ),
        ),
        ("no fading on glossy surfaces", without_fading()?),
        (
            "other neighbours",
            frame.other_sent(view, [&shading, &DiParams { pairs: shading.pairs.map(|_| 1), ..shading }]),
        ),
    ];
    for (what, differ) in seen {
        ensure(differ > count / 20, || format!("{what}: {differ} words differ of {count} pixels"))?;
    }
    Ok(())
}
