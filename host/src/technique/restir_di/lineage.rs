//! Where the sample of a reservoir comes from: the passes of a render with all that they read, so that each pixel of one
//! can be replayed natively, whatever executor ran it.

use crate::plan::{BufferId, Pass};
use crate::{Error, buffers::SceneBuffers, exec::Step, render::Render, replay::TwoFrames};
use restir_kernels::restir_di::{di_combine, di_initial, di_primary, di_tiles};
use restir_shared::scene::{Frames, LightAddress};
use restir_shared::technique::restir_di::{self as di, DiParams, Flags, PackedHit, PackedReservoir, TileWords};
use std::{collections::BTreeMap, sync::Arc};

/// Where a pass has a pixel's sample from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A candidate of its own, if the reservoir has a sample: the index of one from lights, over all rounds of them, or [`di::FROM_SCATTERING`].
    Candidate(u32),
    /// A reservoir that another pass has made.
    Reservoir {
        /// Index of that pass among those that make reservoirs.
        made_by: usize,
        /// Index of the pixel.
        pixel: u32,
        /// It is not the pixel's own.
        is_other: bool,
        /// It is of the last frame.
        of_last_frame: bool,
    },
}

/// Reservoirs as a pass left them.
#[derive(Clone)]
pub(super) struct Reservoirs {
    pub(super) words: Arc<[PackedReservoir]>,
    pub(super) made_by: usize,
}

/// A pass that makes reservoirs.
pub(super) struct ReservoirPass {
    pub(super) params: DiParams,
    pub(super) frames: Arc<TwoFrames>,
    pub(super) made: Reservoirs,
    hits: Arc<[PackedHit]>,
    /// Of candidates; empty where each pixel samples its own.
    tiles: Arc<[TileWords]>,
    /// None for a pass of initial candidates.
    combined: Option<Combined>,
}

/// What a combine reads beside its hits.
struct Combined {
    other_hits: Arc<[PackedHit]>,
    others: Reservoirs,
    /// Of each pixel: in another plane than its neighbours', if those are of the last frame.
    own: Reservoirs,
}

impl ReservoirPass {
    pub(super) fn is_initial(&self) -> bool {
        self.combined.is_none()
    }

    pub(super) fn is_temporal(&self) -> bool {
        self.params.flags.contains(Flags::OTHER_FRAME)
    }

    pub(super) fn position(&self, pixel: u32) -> [u32; 2] {
        [pixel % self.params.width, pixel / self.params.width]
    }

    /// The reservoir of a pixel, computed once more, and where its sample comes from.
    pub(super) fn replay(&self, pixel: u32) -> (PackedReservoir, Origin) {
        let (p, at, index) = (&self.params, self.position(pixel), pixel as usize);
        let frames = &*self.frames;
        let Some(Combined { other_hits, others, own }) = &self.combined else {
            let scene = frames.scene(false);
            let (word, _, candidate) = di::initial(&scene, p, &self.tiles, self.hits[index], at);
            return (word, Origin::Candidate(candidate));
        };
        let planes = di::Planes { hits: &self.hits, other_hits, others: &others.words };
        let (word, source) = di::combine(frames, p, &planes, own.words[index], at);
        let di::Source { is_other, pixel } = source;
        let made_by = if is_other { others } else { own }.made_by;
        (word, Origin::Reservoir { made_by, pixel, is_other, of_last_frame: is_other && self.is_temporal() })
    }

    /// The target of an address at a pixel, without visibility.
    pub(super) fn target(&self, pixel: u32, address: LightAddress) -> f32 {
        let (frames, p, at) = (&*self.frames, &self.params, self.position(pixel));
        di::target(&frames.scene(false), p, self.hits[pixel as usize], at, address)
    }
}

/// Follows the reservoirs of a render from pass to pass.
pub(super) struct Follower {
    frames: Arc<TwoFrames>,
    features: u32,
    hits: BTreeMap<BufferId, Arc<[PackedHit]>>,
    reservoirs: BTreeMap<BufferId, Reservoirs>,
    tiles: Arc<[TileWords]>,
    /// Passes so far that have made reservoirs.
    passes: usize,
}

impl Follower {
    pub(super) fn new(scene: &SceneBuffers, render: &Render) -> Self {
        let features = render.technique.integral().features(scene.features);
        let frames = Arc::new(TwoFrames::still(scene, features));
        Self { frames, features, hits: BTreeMap::new(), reservoirs: BTreeMap::new(), tiles: [].into(), passes: 0 }
    }

    /// The passes whose reservoirs are still in some plane.
    pub(super) fn kept(&self) -> impl Iterator<Item = usize> {
        self.reservoirs.values().map(|reservoirs| reservoirs.made_by)
    }

    /// What the step was, if it made reservoirs. Every step of the render has to be shown.
    ///
    /// # Errors
    /// What a GPU reports, and [`Error::Kernel`] if a pass reads a plane that no step before has made.
    pub(super) fn follow(&mut self, step: &Step<'_>) -> Result<Option<ReservoirPass>, Error> {
        if let Some(scenes) = step.pass.frame.as_ref().and_then(|frame| frame.scenes.clone()) {
            self.frames = Arc::new(TwoFrames::new(scenes, self.features));
        }
        let (pass, name) = (step.pass, step.pass.kernel.name);
        if name == di_tiles::DESC.name {
            self.tiles = step.plane("tiles")?.into();
        } else if name == di_primary::DESC.name {
            self.hits.insert(pass.bound("hits")?, step.plane("hits")?.into());
        }
        let is_combine = name == di_combine::DESC.name;
        let makes_reservoirs = is_combine || name == di_initial::DESC.name;
        let Some(params) = pass.params::<DiParams>().filter(|_| makes_reservoirs) else { return Ok(None) };
        let hits = |role| known(&self.hits, pass, role);
        let combined = if is_combine {
            let others = known(&self.reservoirs, pass, "others")?;
            let in_place = params.flags.contains(Flags::OTHER_FRAME);
            let own = if in_place { known(&self.reservoirs, pass, "reservoirs")? } else { others.clone() };
            Some(Combined { other_hits: hits("other_hits")?, others, own })
        } else {
            None
        };
        let hits = hits("hits")?;
        let made = Reservoirs { words: step.plane("reservoirs")?.into(), made_by: self.passes };
        self.reservoirs.insert(pass.bound("reservoirs")?, made.clone());
        self.passes += 1;
        let (frames, tiles) = (self.frames.clone(), self.tiles.clone());
        Ok(Some(ReservoirPass { params, frames, made, hits, tiles, combined }))
    }
}

/// What an earlier pass left in the buffer of a role.
fn known<T: Clone>(planes: &BTreeMap<BufferId, T>, pass: &Pass, role: &str) -> Result<T, Error> {
    let plane = planes.get(&pass.bound(role)?).cloned();
    let problem = || format!("reads {role} that no pass before it has made; show every pass of the render");
    plane.ok_or_else(|| Error::Kernel { kernel: pass.kernel.name.to_owned(), problem: problem() })
}
