//! ReSTIR SSS: what no preset has, and the scenes in which it is compared with path tracing.

use super::{Cases, Known, Matrix, NOTHING, Row, Trials, row};
use crate::native;
use crate::stats::Moments;
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_kernels::path::path_entry;
use restir_kernels::restir_sss::sss_initial;
use restir_shared::diffusion::{Disk, DiskNumbers, Profile};
use restir_shared::geometry::Hit;
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::resample::mutual::{Cause, Record, Shift, ShiftResult, Shifted};
use restir_shared::resample::params::ReuseParams;
use restir_shared::scene::{AddressedLights, LightKind, Location, Probe, SceneView, Still, Surface};
use restir_shared::technique::path::PathFlags;
use restir_shared::technique::path::PathParams;
use restir_shared::technique::path::hybrid::{self, Fit, HybridParams};
use restir_shared::technique::restir_sss::{self, Initial, Kind, PackedSubsurface, Sample, SssOrigin, SssParams};
use restir_shared::vec::luminance;
use std::collections::BTreeMap;

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    rows: &[
        (
            "single scattering traced, two passes, not defensive, jitter",
            "traced=single,spatial=2,mis=pairwise,jitter=on",
        ),
        ("one crossing of three segments", "crossings=one,segments=3,radius_channel=albedo,shading=selected"),
        ("delayed, no feedback", "shift=delayed,feedback=off,neighbours=2,temporal_mis=pairwise-defensive"),
    ],
    cases: Cases { rows: &ROWS, ..NOTHING.cases },
    matrix: Matrix {
        scenes: &[
            ("slab", ""),
            ("candles", ""),
            ("skin-statue", ""),
            ("turning-statue", ""),
            ("touching", ""),
            ("moving-media", ""),
            ("marble-hall", ""),
            ("passing-statue", ""),
        ],
        goals: &[("candles", 4.0)],
        tile_goal: 5.0,
        common: "",
        cells: || CELLS.map(str::to_owned).to_vec(),
        ..NOTHING.matrix
    },
    ..NOTHING
};

/// Every shift, sharing alone and with time, and the hybrid whose profile part reuses.
const CELLS: [&str; 6] = [
    "shift=reconnection,temporal=off",
    "shift=delayed,spatial=0",
    "shift=hybrid",
    "shift=hybrid,feedback=off,mis=pairwise,confidence_cap=20",
    "shift=sequential,spatial=2,neighbours=4",
    "shift=hybrid,traced=single",
];

/// Every shift, kind of light and of surface.
const ROWS: [Row; 10] = [
    row("hybrid", "slab", 3, ""),
    row("reconnection, lights in wax, milk", "candles", 3, "shift=reconnection,spatial=2"),
    row("delayed, lights in wax, milk", "candles", 2, "shift=delayed,feedback=off,max_depth=6"),
    row("things move, textures", "moving-media", 5, "traced=single,jitter=on,max_depth=5"),
    row("things move, delayed", "moving-media", 4, "shift=delayed,lambert_below=0.2,sampler=independent"),
    row("one crossing, published support", "slab", 2, "crossings=one,support=published,segments=2,shading=selected"),
    row("signed profiles", "slab", 2, "traced=single,profile=searchlight,radius_channel=albedo"),
    row("clamped profiles", "candles", 2, "traced=single,profile=clamped,mis=pairwise-counted-defensive"),
    row("sequential", "candles", 3, "shift=sequential,spatial=2,neighbours=3"),
    row("no bodies", "cornell", 2, ""),
];

/// A picture whose pixels' samples are shifted to each other.
pub struct Picture<'a> {
    /// The scene.
    pub scene: SceneView<'a>,
    /// Parameters of initial samples and of shifts.
    pub params: SssParams,
    entry: HybridParams,
}

/// What a kind of samples is called.
pub fn name_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Kept => "kept",
        Kind::Replayed => "replayed",
        Kind::AtEntry => "at entry",
    }
}

impl<'a> Picture<'a> {
    /// The picture that a render with these settings makes, in the parameters of its own passes.
    ///
    /// # Errors
    /// For settings that there are not, and a plan without the passes.
    pub fn new(buffers: &'a SceneBuffers, size: [u32; 2], settings: &str) -> Result<Self, Failed> {
        let technique = Trials::of("restir-sss")?.with(&format!("sampler=independent,{settings}"))?;
        let render = Render { seed: 5, ..Render::new(size, technique) };
        let (mut entry, mut params) = (None, None);
        for pass in native::plan(buffers, &render).passes {
            let pass = pass?;
            if pass.kernel.name == path_entry::DESC.name {
                entry = pass.params::<HybridParams>();
            } else if pass.kernel.name == sss_initial::DESC.name {
                params = pass.params::<SssParams>();
            }
        }
        let (entry, params) = (entry.ok_or("no entries")?, params.ok_or("no samples")?);
        Ok(Self { scene: buffers.view(), params, entry })
    }

    /// What a pixel's entry gives in a frame.
    pub fn initial(&self, at: [u32; 2], frame: u32) -> Initial {
        let path = PathParams { first_sample: frame, ..self.entry.path };
        let entered = hybrid::enter(&self.scene, &HybridParams { path, ..self.entry }, at);
        let params = SssParams { reuse: ReuseParams { frame, ..self.params.reuse }, ..self.params };
        restir_sss::initial(&self.scene, &params, entered.entry, at)
    }

    /// What path tracing with diffusion finds in the pixel's body by the numbers of the initial sample: the light of all candidates.
    pub fn gathered(&self, at: [u32; 2], frame: u32) -> Vec3 {
        let flags = self.entry.path.flags | self.params.profile | PathFlags::PROFILE;
        let path = PathParams { first_sample: frame, flags, ..self.entry.path };
        let params = HybridParams { path, segments: self.params.segments, ..self.entry };
        let entered = hybrid::enter(&self.scene, &params, at);
        if !entered.entry.is_inside() {
            return Vec3::ZERO;
        }
        let gathered = hybrid::gather(&self.scene, &params, entered.entry, at);
        Vec3::from_array(gathered.sample.sum) - Vec3::from_array(entered.sample.sum)
    }

    /// A sample at another entry.
    pub fn shift(&self, sample: &PackedSubsurface, to: &SssOrigin) -> Shifted {
        sample.shifted(&Still(&self.scene), &self.params, to)
    }

    /// By which segments look for points around an entry.
    pub fn disk(&self, origin: &SssOrigin) -> (Disk, Location) {
        let (hit, SssParams { profile: flags, lambert_below, .. }) = (origin.hit.unpack(), self.params);
        let fit = Fit { flags, lambert_below: lambert_below * restir_shared::camera::spread(&self.params.camera) };
        let (at, interior) = (self.scene.location(&hit), self.scene.interior(&hit));
        let profile = Profile::of_medium(&interior.medium(self.scene.absorbed(&hit)), fit.shape());
        let profile = profile.of_channels(fit.spread(&interior, origin.travelled));
        let profile = if flags.contains(PathFlags::BY_ALBEDO) { profile.chosen_by_albedo() } else { profile };
        (Disk { support: fit.support(), ..Disk::new(at.position, at.normal, profile) }, at)
    }

    /// The hit that a sample is at an entry, if it is one.
    pub fn hit(&self, sample: &Sample, origin: &SssOrigin) -> Hit {
        match sample.kind {
            Kind::Kept => sample.hit,
            Kind::AtEntry => origin.hit.unpack(),
            Kind::Replayed => {
                let segment = self.disk(origin).0.segment(&sample.numbers);
                let body = self.scene.interior(&origin.hit.unpack()).body;
                self.scene.probe(&segment, body).nearest[sample.crossing as usize]
            }
        }
    }

    /// The pixels that see a body.
    pub fn entering(&self) -> Vec<[u32; 2]> {
        let SssParams { reuse: ReuseParams { width, height, .. }, .. } = self.params;
        let all = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        all.filter(|at| (0..4).any(|frame| self.initial(*at, frame).origin.hit.unpack().is_hit())).collect()
    }

    /// Pairs of pixels that see bodies, `step` apart, none of which is in two pairs.
    pub fn pairs(&self, [dx, dy]: [u32; 2]) -> Vec<[[u32; 2]; 2]> {
        let entering = self.entering();
        let mut taken: Vec<[u32; 2]> = Vec::new();
        let mut pairs = Vec::new();
        for &[x, y] in &entering {
            let pair = [[x, y], [x + dx, y + dy]];
            if entering.contains(&pair[1]) && !pair.iter().any(|at| taken.contains(at)) {
                taken.extend(pair);
                pairs.push(pair);
            }
        }
        pairs
    }
}

/// A way to shift wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// Right.
    Not,
    /// The Jacobian is that over solid angles at the points, while samples lie over areas of lights.
    SolidAngle,
    /// The channel's probability is taken to be the same at both entries.
    SameProbability,
}

/// A sample where it was found and where it is shifted to.
struct Taken<'a> {
    sample: &'a Sample,
    from: &'a SssOrigin,
    to: &'a SssOrigin,
}

impl Picture<'_> {
    /// The Jacobian of a shift that has succeeded.
    fn jacobian(&self, taken: &Taken<'_>, shifted: &Shifted, wrong: Wrong) -> f64 {
        let right = f64::from(shifted.term) / f64::from(taken.sample.partial_jacobian);
        if taken.sample.kind != Kind::Replayed {
            return right;
        }
        match wrong {
            Wrong::Not => right,
            Wrong::SolidAngle => right * self.subtended(taken, taken.to) / self.subtended(taken, taken.from),
            Wrong::SameProbability => {
                let of =
                    |origin| f64::from(self.disk(origin).0.profile.probability[taken.sample.numbers.channel as usize]);
                right * of(taken.from) / of(taken.to)
            }
        }
    }

    /// The solid angle of a light's area from where the sample is at an entry.
    fn subtended(&self, taken: &Taken<'_>, origin: &SssOrigin) -> f64 {
        let light = self.scene.light_at(taken.sample.light).sample;
        if light.kind != LightKind::Area {
            return 1.0;
        }
        let at = self.scene.location(&self.hit(taken.sample, origin));
        let between = light.position.as_dvec3() - at.position.as_dvec3();
        between.normalize().dot(light.normal.as_dvec3()).abs() / between.length_squared()
    }
}

/// The density of a point by one axis and channel, but for a factor that all disks of the medium have in common.
pub fn density_of(disk: &Disk, numbers: &DiskNumbers, point: DVec3, normal: DVec3) -> f64 {
    let axis = [disk.frame.n, disk.frame.s, disk.frame.t][numbers.axis as usize].as_dvec3();
    let beside = point - disk.centre.as_dvec3();
    let radius = (beside - axis * beside.dot(axis)).length();
    let distance = f64::from(disk.profile.distance[numbers.channel as usize]);
    let (x, falloff) = (radius / distance, (-radius / (3.0 * distance)).exp());
    (falloff + falloff.powi(3)) / (x * distance * distance) * normal.dot(axis).abs()
}

/// What became of shifts there and back.
#[derive(Clone, Debug, Default)]
pub struct Returns {
    /// Shifts by the kind of the sample and what came of them.
    pub there: BTreeMap<(&'static str, Cause), u64>,
    /// Of those that gave a sample, those that the second pixel does not have as its own, and those that do not return.
    pub one_sided: u64,
    /// The largest error of the product of both Jacobians.
    pub jacobian: f64,
    /// The largest relative error of an integrand of a replayed sample, or one at an entry, that came back.
    pub replayed: f64,
    /// The relative errors of integrands of kept samples that came back, in units of what storing the point loses.
    pub kept: Vec<f64>,
}

impl Returns {
    /// Shifts the samples that the first pixel of each pair finds in each of so many frames to the second, and back.
    pub fn of(picture: &Picture<'_>, pairs: &[[[u32; 2]; 2]], frames: u32) -> Self {
        let of_pair = |&[x, y]: &[[u32; 2]; 2]| {
            let mut returns = Self::default();
            for frame in 0..frames {
                let (home, away) = (picture.initial(x, frame), picture.initial(y, frame));
                if home.reservoir.contribution_weight() > 0.0 && away.origin.hit.unpack().is_hit() {
                    returns.add(picture, &home, &away.origin);
                }
            }
            returns
        };
        let all: Vec<Self> = pairs.par_iter().map(of_pair).collect();
        all.into_iter().fold(Self::default(), Self::merge)
    }

    /// How many samples of a kind were shifted.
    pub fn shifted(&self, kind: Kind) -> u64 {
        self.there.get(&(name_of(kind), Cause::Nothing)).copied().unwrap_or(0)
    }

    fn merge(mut self, other: Self) -> Self {
        other.there.into_iter().for_each(|(cause, count)| *self.there.entry(cause).or_default() += count);
        self.one_sided += other.one_sided;
        (self.jacobian, self.replayed) = (self.jacobian.max(other.jacobian), self.replayed.max(other.replayed));
        self.kept.extend(other.kept);
        self
    }

    fn add(&mut self, picture: &Picture<'_>, home: &Initial, away: &SssOrigin) {
        let (found, there) = (home.reservoir, picture.shift(&home.reservoir, away));
        let sample = found.unpack().sample;
        *self.there.entry((name_of(sample.kind), there.cause)).or_default() += 1;
        if there.term == 0.0 {
            return;
        }
        let moved = found.moved(&ShiftResult::of(&there));
        let [own, back] = [away, &home.origin].map(|origin| picture.shift(&moved, origin));
        if own.term == 0.0 || back.term == 0.0 {
            self.one_sided += 1;
            return;
        }
        let ratio = |a: f32, b: f32| f64::from(a) / f64::from(b);
        let product = ratio(there.term, found.partial_jacobian()) * ratio(back.term, moved.partial_jacobian());
        self.jacobian = self.jacobian.max((product - 1.0).abs());
        let error = ratio((back.value - found.value()).abs().max_element(), found.value().abs().max_element());
        if sample.kind == Kind::Kept {
            self.kept.push(error / picture.lost(&sample, &home.origin));
        } else {
            self.replayed = self.replayed.max(error);
        }
    }
}

impl Picture<'_> {
    /// What a profile changes relatively where coordinates of 24 bits, and positions in `f32` of them, have moved the point: it falls as
    /// `exp(-r / d) / r` at the fastest, and twenty roundings of an `f32` come with that.
    fn lost(&self, sample: &Sample, origin: &SssOrigin) -> f64 {
        let (disk, _) = self.disk(origin);
        let corner = |u: f32, v: f32| {
            let hit = Hit { uv: restir_shared::glam::Vec2::new(u, v), ..sample.hit };
            self.scene.location(&hit).position.as_dvec3()
        };
        let step = [corner(1.0, 0.0), corner(0.0, 1.0)].map(|to| (to - corner(0.0, 0.0)).length() * 2.0_f64.powi(-24));
        let position = self.scene.location(&sample.hit).position;
        let far = (position - disk.centre).as_dvec3().length();
        let rounding = position.as_dvec3().length() * 2.0_f64.powi(-23);
        let shortest = disk.profile.distance.to_array().into_iter().filter(|d| *d > 0.0).fold(f32::MAX, f32::min);
        (step[0] + step[1] + rounding) * (1.0 / far + 1.0 / f64::from(shortest)) + 20.0 * 2.0_f64.powi(-24)
    }
}

/// What the second pixels of pairs get by shifts of the first one's samples, less what they find of it themselves, each by its weight in
/// the balance heuristic between the two. Zero in the mean, pair by pair, if shifts are undone and Jacobians right.
#[derive(Clone, Debug, Default)]
pub struct Arrivals {
    /// The first pixel of each pair.
    pub at: Vec<[u32; 2]>,
    /// Of each pair and each kind of samples: what arrives less what is found there, over all frames, in luminance.
    pub pairs: Vec<BTreeMap<&'static str, Moments>>,
    /// Of each pair and each kind the share of frames in which anything arrives or is found.
    pub said: Vec<BTreeMap<&'static str, f64>>,
    /// What all pixels find of it themselves, by kind.
    pub own: BTreeMap<&'static str, f64>,
    /// How many samples arrived, by kind.
    pub count: BTreeMap<&'static str, u64>,
}

/// The kinds of samples; of replayed ones also those whose channel is less probable at the second pixel, or more.
pub const LABELS: [&str; 5] = ["kept", "replayed", "at entry", "replayed to less", "replayed to more"];

impl Arrivals {
    /// Of so many frames, whose random numbers have nothing to do with each other.
    pub fn of(picture: &Picture<'_>, pairs: &[[[u32; 2]; 2]], frames: u32, wrong: Wrong) -> Self {
        let of_pair = |&[x, y]: &[[u32; 2]; 2]| {
            let mut arrivals = Self::default();
            let (mut moments, mut said) = (BTreeMap::<_, Moments>::new(), BTreeMap::<_, f64>::new());
            for frame in 0..frames {
                let (home, away) = (picture.initial(x, frame), picture.initial(y, frame));
                let arriving = picture.shared(&home, &away.origin, wrong, true);
                let own = picture.shared(&away, &home.origin, wrong, false);
                let kinds =
                    |found: &Initial| picture.label(&found.reservoir.unpack().sample, &home.origin, &away.origin);
                let [arriving, own] = [(&home, arriving), (&away, own)].map(|(found, shared)| (kinds(found), shared));
                for kind in LABELS {
                    let of = |(label, shared): (&'static str, f64)| if label == kind { shared } else { 0.0 };
                    moments.entry(kind).or_default().push(of(arriving) - of(own));
                    let says = of(arriving) != 0.0 || of(own) != 0.0;
                    *said.entry(kind).or_default() += if says { 1.0 / f64::from(frames) } else { 0.0 };
                    *arrivals.own.entry(kind).or_default() += of(own) / f64::from(frames);
                    *arrivals.count.entry(kind).or_default() += u64::from(of(arriving) != 0.0);
                }
            }
            arrivals.at.push(x);
            arrivals.pairs.push(moments);
            arrivals.said.push(said);
            arrivals
        };
        let all: Vec<Self> = pairs.par_iter().map(of_pair).collect();
        all.into_iter().fold(Self::default(), Self::merge)
    }

    fn merge(mut self, other: Self) -> Self {
        self.at.extend(other.at);
        self.pairs.extend(other.pairs);
        self.said.extend(other.said);
        other.own.into_iter().for_each(|(kind, own)| *self.own.entry(kind).or_default() += own);
        other.count.into_iter().for_each(|(kind, count)| *self.count.entry(kind).or_default() += count);
        self
    }
}

impl Picture<'_> {
    /// One of [`LABELS`].
    fn label(&self, sample: &Sample, home: &SssOrigin, away: &SssOrigin) -> &'static str {
        if sample.kind != Kind::Replayed || !home.hit.unpack().is_hit() || !away.hit.unpack().is_hit() {
            return name_of(sample.kind);
        }
        let [home, away] = [home, away].map(|at| self.disk(at).0.profile.probability[sample.numbers.channel as usize]);
        if away < 0.99 * home {
            LABELS[3]
        } else if home < 0.99 * away {
            LABELS[4]
        } else {
            LABELS[1]
        }
    }

    /// What a pixel's sample brings to another one, or what stays with the pixel of its own sample where the other one has it, too: the
    /// luminance, weighted by how much of both the first pixel finds.
    fn shared(&self, found: &Initial, to: &SssOrigin, wrong: Wrong, arrives: bool) -> f64 {
        let (record, weight) = (found.reservoir, f64::from(found.reservoir.contribution_weight()));
        let shifted = self.shift(&record, to);
        if shifted.term == 0.0 {
            return 0.0;
        }
        let sample = record.unpack().sample;
        let jacobian = self.jacobian(&Taken { sample: &sample, from: &found.origin, to }, &shifted, wrong);
        let target = |value: Vec3| f64::from(PackedSubsurface::target(value));
        let (here, there) = (target(record.value()), target(shifted.value) * jacobian);
        let brightness = |value: Vec3| f64::from(luminance(value));
        if arrives {
            brightness(shifted.value) * jacobian * weight * here / (here + there)
        } else {
            brightness(record.value()) * weight * there / (here + there)
        }
    }
}
