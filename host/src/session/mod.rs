//! Frames one after another, for renderers that show each of them: [`CpuSession`], and `GpuSession` on the renderer's own device.
//!
//! A session holds a scene in its arenas, and the planes of a technique, for as long as it lives. Each frame is given a [`View`]:
//! the camera, and what has changed in the scene. What of the last frames is still true is reused; what is not, is forgotten, and from
//! then on the bits are those of a new session. [`Render::render`] makes the same frames with the same bits.
//!
//! ```
//! use restir_host::session::{CpuSession, History, SceneChange, Setup, View};
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let mut scene = Scene::load("cornell")?;
//! let setup = Setup::new(SceneBuffers::build_editable(&scene)?, DiSettings::default(), [32, 24]);
//! let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
//! assert_eq!(session.frame(&View::default())?.history, History::New);
//!
//! // an object moves, and what earlier frames have found is kept
//! scene.instances.last_mut().expect("an instance").transform.translation.x += 0.01;
//! let moved = View { scene: SceneChange::Edited(&scene), ..View::default() };
//! let begun = session.frame(&moved)?;
//! assert!(begun.history == History::Kept && begun.uploaded > 0);
//! assert!(session.pixels().iter().all(|pixel| pixel.sum[1].is_finite() && pixel.dropped == 0.0));
//! # Ok::<(), Error>(())
//! ```

mod cpu;
#[cfg(feature = "gpu")]
mod deferred;
#[cfg(feature = "gpu")]
mod gpu;

pub use cpu::CpuSession;
#[cfg(feature = "gpu")]
pub use deferred::RayRound;
#[cfg(feature = "gpu")]
pub use gpu::{GpuSession, SurfacePlane};

use crate::denoise::{self, Denoise};
use crate::exec::Dispatches;
use crate::moments::Moments;
use crate::plan::{ARENAS, Buffer, BufferId, Pass, SceneFrame};
use crate::render::Render;
use crate::scene::{Animation, Camera, Scene};
use crate::sequence::{Frame, Sequence, Stage};
use crate::settings::More;
use crate::technique::Technique;
use crate::{Error, buffers::SceneBuffers};
use restir_kernels::KernelDesc;
use restir_shared::layout::{CameraParams, FEATURE_BLEND, FEATURE_GIVEN};
use restir_shared::scene::{GivenPlanes, GivenSurface};
use std::{fmt, sync::Arc};

/// Bytes of a word of an arena.
const WORD: usize = 16;
/// The arena behind which surfaces are given.
const ATTRIBUTES: BufferId = ARENAS[1].1;

/// What a session is of, made by [`Self::new`] and changed field by field. Fields may be added with any version.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The scene; one that will be edited is built by [`SceneBuffers::build_editable`].
    pub scene: Arc<SceneBuffers>,
    /// The technique and its settings, those of a preset by `preset` of their type. What it does not follow of the scene's
    /// light says [`Diagnose::leaves_out`](crate::technique::Diagnose::leaves_out).
    pub technique: Box<dyn Technique>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Seed of the random numbers.
    pub seed: u32,
    /// Samples a pixel in each frame, of techniques that repeat samples (`path`); those that repeat frames take no notice. Not zero.
    pub samples: u32,
    /// The image is the mean of all frames since the view last changed, of at most so many: then the mean begins anew. With `None` each
    /// frame is an image of its own. Samples of a technique that takes samples are counted from the beginning of a mean, so that it has the
    /// bits of a render: while the view changes, every frame has the same random numbers.
    pub mean_of: Option<u32>,
    /// Frames are denoised.
    pub denoise: Option<Denoise>,
    /// The renderer gives what the camera sees as surfaces, a G-buffer that need not show anything of the scene: in each frame it fills the
    /// session's plane of surfaces (`surfaces` of `GpuSession`, [`CpuSession::surfaces_mut`]) and that of primary hits, with the number that the former says, and gives
    /// [`View::primary_given`]. Rays meet the scene alone. For techniques that have a plane of primary hits, without a denoiser. The planes take 256 bytes a pixel, in
    /// one binding with the scene's attributes: 530 MB at 1920 x 1080. A frame whose scene is built anew ([`History::Lost`]) shows the scene's own surfaces: go on by
    /// [`Session::set_scene`] before the planes are written.
    pub surfaces_given: bool,
    #[doc(hidden)]
    pub _more: More,
}

impl Setup {
    /// Frames of one sample, each an image of its own, with the seed 0.
    pub fn new(scene: SceneBuffers, technique: impl Into<Box<dyn Technique>>, size: [u32; 2]) -> Self {
        Self {
            scene: Arc::new(scene),
            technique: technique.into(),
            size,
            seed: 0,
            samples: 1,
            mean_of: None,
            denoise: None,
            surfaces_given: false,
            _more: More::default(),
        }
    }

    /// As [`Self::new`], over a scene of other types than this library's, whose surfaces and lights may have `features`
    /// ([`restir_shared::scene::Surface::features`]): for [`CpuSession::frame_over`].
    pub fn foreign(features: u32, technique: impl Into<Box<dyn Technique>>, size: [u32; 2]) -> Self {
        Self::new(SceneBuffers::foreign(features), technique, size)
    }

    fn check(&self) -> Result<(), Error> {
        let [width, height] = self.size;
        let frames = self.mean_of.unwrap_or(1);
        let Some(count) = frames.checked_mul(self.samples).filter(|&count| count > 0) else {
            return Err(Error::Mean { frames, samples: self.samples });
        };
        let accumulate = self.mean_of.is_some();
        let denoise = self.denoise.clone();
        let render = Render { count, accumulate, denoise, ..Render::new([width, height], self.technique.clone()) };
        render.check_settings(&self.scene)
    }

    fn stage(&self, moments: &Moments, dispatches: Dispatches) -> Stage {
        Stage {
            size: self.size,
            seed: self.seed,
            goes_on: true,
            most: self.samples * self.mean_of.unwrap_or(1),
            progressive: self.mean_of.is_some(),
            features: self.features(),
            arenas: self.arenas(moments),
            dispatches,
            share: None,
            given: self.given(moments),
        }
    }

    fn features(&self) -> u32 {
        self.scene.features | if self.surfaces_given { FEATURE_GIVEN } else { 0 }
    }

    /// Where surfaces are given: behind what the arena of attributes has of the scene.
    fn given(&self, moments: &Moments) -> Option<GivenPlanes> {
        let [_, attributes, _] = moments.buffers();
        let [width, height] = self.size;
        // at most 2^31, as an image has at most 2^28 pixels
        let words = width * height * (size_of::<GivenSurface>() / WORD) as u32;
        let base = attributes.words.div_ceil(WORD / 4) as u32;
        self.surfaces_given.then_some(GivenPlanes { base, words, half: 0 })
    }

    fn arenas(&self, moments: &Moments) -> [Buffer; 3] {
        let mut arenas = moments.buffers();
        if let Some(GivenPlanes { base, words, .. }) = self.given(moments) {
            arenas[ATTRIBUTES].words = (base as usize + 2 * words as usize) * WORD / 4;
        }
        arenas
    }

    /// What decides how large the arenas are.
    fn arenas_of(&self) -> (*const SceneBuffers, usize, Option<[u32; 2]>) {
        (Arc::as_ptr(&self.scene), self.parts(), self.surfaces_given.then_some(self.size))
    }

    fn parts(&self) -> usize {
        1 + usize::from(self.technique.looks_back() || self.denoise.is_some())
    }

    fn sequence(&self, moments: &Moments, dispatches: Dispatches) -> Box<dyn Sequence> {
        denoise::sequence(&*self.technique, self.denoise.as_ref(), &self.stage(moments, dispatches))
    }
}

/// What a frame shows.
#[derive(Clone, Debug, Default)]
pub struct View<'a> {
    /// The camera, relative to [`Scene::origin`](crate::scene::Scene::origin) (see [`Camera::moved`]); that of the scene if there is none.
    pub camera: Option<Camera>,
    /// What has become of the scene.
    pub scene: SceneChange<'a>,
    /// What the camera sees was written to the session's plane of primary hits, and is not looked for: for each pixel the nearest hit of the
    /// ray through its centre, with its distance from the camera, which is the same hit as long as camera and scene are the same. A frame whose scene has to be built
    /// anew finds its hits itself, for its triangles have other ids, and the session another plane.
    pub primary_given: bool,
    /// Of [`Setup::surfaces_given`]: what they show has moved since the last frame, be it that the scene has not.
    pub surfaces_moved: bool,
    #[doc(hidden)]
    pub _more: More,
}

/// What has become of the scene since the last frame.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum SceneChange<'a> {
    /// The scene stays as it is.
    #[default]
    None,
    /// It is the moment of its animation that frame `f` shows, which may lie between two; edits are undone by it.
    Frame(f64),
    /// It was edited, and is as it stands, without its animation. Transforms, positions of vertices, factors of materials, and lights may differ without loss of history; whatever
    /// else differs, the scene is built anew.
    Edited(&'a Scene),
}

/// What a session reports of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Begun {
    /// What became of earlier frames.
    pub history: History,
    /// The number of dispatches that were recorded.
    pub passes: usize,
    /// Bytes that were written to the arenas.
    pub uploaded: u64,
}

/// What became of earlier frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum History {
    /// There were none: the session is new, or was reset.
    New,
    /// They are reused as far as the technique does.
    Kept,
    /// The scene was built anew, and the earlier frames are forgotten: an edited scene differs from the last frame's in what is named here,
    /// or was not built by [`SceneBuffers::build_editable`] ("that it moves").
    Lost(&'static str),
}

/// A session on some device. It is made by `new` of [`CpuSession`] or `GpuSession`, and its frames by their method `frame`.
pub struct Session<D> {
    setup: Setup,
    moments: Moments,
    sequence: Box<dyn Sequence>,
    /// Number of the next frame since the history began.
    next: u32,
    /// Frames in the mean.
    in_mean: u32,
    last_camera: Option<CameraParams>,
    device: D,
}

/// Where the buffers of a session are.
trait Device {
    /// How long its dispatches may be.
    const DISPATCHES: Dispatches;

    /// Makes the buffers. Of those that there are, the arenas are kept if they are known to be right; planes may hold anything.
    fn allocate(&mut self, buffers: &[Buffer], keep_arenas: bool, scene: &Arc<SceneBuffers>) -> Result<(), Error>;

    /// Gets ready to run kernels.
    fn prepare(&mut self, kernels: &[Frozen]) -> Result<(), Error>;
}

/// A kernel and the values of its specialization constants.
type Frozen = (&'static KernelDesc, Vec<u32>);

impl<D> fmt::Debug for Session<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("setup", &self.setup).field("frames", &self.next).finish_non_exhaustive()
    }
}

impl<D> Session<D> {
    /// What the session is of; the scene is that of the last frame.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// How many frames there were since the history began.
    pub fn frames(&self) -> u32 {
        self.next
    }
}

#[expect(private_bounds, reason = "there are two devices, and both are here")]
impl<D: Device> Session<D> {
    fn over(setup: Setup, mut device: D) -> Result<Self, Error> {
        setup.check()?;
        let moments = Moments::new(setup.scene.clone(), setup.parts());
        let sequence = setup.sequence(&moments, D::DISPATCHES);
        check_surfaces(&setup, &moments, &*sequence)?;
        device.prepare(&kernels(&setup, &moments)?)?;
        device.allocate(sequence.buffers(), false, &setup.scene)?;
        Ok(Self { setup, moments, sequence, next: 0, in_mean: 0, last_camera: None, device })
    }

    /// Forgets all frames, as after a cut: the next one has the bits of a new session's first.
    pub fn reset(&mut self) {
        self.moments.forget();
        self.sequence = self.setup.sequence(&self.moments, D::DISPATCHES);
        (self.next, self.in_mean, self.last_camera) = (0, 0, None);
    }

    /// Goes on with another size, and a new history.
    ///
    /// # Errors
    /// As of making a session; this one is then as it was.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), Error> {
        self.change(Setup { size, ..self.setup.clone() })
    }

    /// Goes on with another technique, or other settings, and a new history.
    ///
    /// # Errors
    /// As of [`Self::resize`].
    pub fn set_technique(&mut self, technique: impl Into<Box<dyn Technique>>) -> Result<(), Error> {
        self.change(Setup { technique: technique.into(), ..self.setup.clone() })
    }

    /// Goes on with another scene, and a new history.
    ///
    /// # Errors
    /// As of [`Self::resize`].
    pub fn set_scene(&mut self, scene: SceneBuffers) -> Result<(), Error> {
        self.change(Setup { scene: Arc::new(scene), ..self.setup.clone() })
    }

    fn change(&mut self, setup: Setup) -> Result<(), Error> {
        setup.check()?;
        let same_scene = Arc::ptr_eq(&setup.scene, &self.setup.scene) && setup.parts() == self.setup.parts();
        let keep_arenas = setup.arenas_of() == self.setup.arenas_of();
        let moments = if same_scene {
            let mut moments = self.moments.clone();
            moments.forget();
            moments
        } else {
            Moments::new(setup.scene.clone(), setup.parts())
        };
        let sequence = setup.sequence(&moments, D::DISPATCHES);
        check_surfaces(&setup, &moments, &*sequence)?;
        self.device.prepare(&kernels(&setup, &moments)?)?;
        self.device.allocate(sequence.buffers(), keep_arenas, &setup.scene)?;
        (self.setup, self.moments) = (setup, moments);
        self.reset();
        Ok(())
    }

    /// The buffer that holds what the camera sees in the next frame.
    fn primary_plane(&self) -> Option<BufferId> {
        self.sequence.primary(self.next)
    }

    /// Where the next frame has its surfaces: the first word in the arena of attributes, how many there are, and the number of the first surface.
    fn surface_plane(&self) -> Option<(usize, usize, u32)> {
        let GivenPlanes { base, words, .. } = self.setup.given(&self.moments)?;
        let half = self.next & 1;
        let words_of = |words: u32| words as usize * WORD / 4;
        Some((words_of(base + half * words), words_of(words), GivenSurface::id(half, 0)))
    }

    /// The passes of the next frame, which is then the last one. Whether a foreign scene has moved is told, not found.
    fn passes(&mut self, view: &View<'_>, foreign_moved: bool) -> Result<(Vec<Pass>, Begun), Error> {
        self.check(view)?;
        let (scene, lost) = self.scene_of(view.scene)?;
        let camera = view.camera.unwrap_or_else(|| match view.scene {
            SceneChange::Frame(frame) => self.setup.scene.camera_at(frame),
            SceneChange::None | SceneChange::Edited(_) => scene.as_ref().unwrap_or(&self.setup.scene).camera,
        });
        let [width, height] = self.setup.size;
        let camera = camera.params(width, height);
        let history = match lost {
            Some(what) => History::Lost(what),
            None if self.next == 0 => History::New,
            None => History::Kept,
        };
        let same_scene = self.next > 0 && scene.is_none() && !foreign_moved && !view.surfaces_moved;
        // the first frame of a scene that moves brings it
        let placed = scene.or_else(|| (self.next == 0).then(|| self.setup.scene.clone()));
        self.setup.scene = placed.as_ref().unwrap_or(&self.setup.scene).clone();
        let begun = self.moments.advance(placed);
        let clears = !same_scene || self.last_camera != Some(camera) || Some(self.in_mean) == self.setup.mean_of;
        let frame = Frame {
            index: self.next,
            samples: self.setup.samples,
            camera,
            last: self.last_camera,
            scenes: self.moments.headers(),
            features: self.setup.features(),
            same_scene,
            // ids of triangles are others in a scene that was built anew
            primary_given: view.primary_given && lost.is_none(),
            clears,
            adds: true,
            shows: true,
        };
        let passes = frame_passes(&mut *self.sequence, frame, begun)?;
        let uploads = passes.iter().filter_map(|pass| pass.frame.as_ref()).flat_map(|frame| &frame.uploads);
        let uploaded = uploads.map(|upload| 4 * upload.words.len() as u64).sum();
        self.next = self.next.wrapping_add(1);
        self.in_mean = if clears { 1 } else { self.in_mean.saturating_add(1) };
        self.last_camera = Some(camera);
        let passes_made = passes.len();
        Ok((passes, Begun { history, passes: passes_made, uploaded }))
    }

    /// Before anything changes: the view is one that can be seen.
    fn check(&self, view: &View<'_>) -> Result<(), Error> {
        if let Some(camera) = &view.camera {
            camera.check().map_err(|problem| Error::Camera { problem })?;
        }
        if let SceneChange::Frame(frame) = view.scene
            && !frame.is_finite()
        {
            let expected = "a finite number".to_owned();
            return Err(Error::InvalidValue { setting: "frame", value: frame.to_string(), expected });
        }
        if !view.primary_given {
            return Ok(());
        }
        let (technique, camera) = (&self.setup.technique, view.camera.unwrap_or(self.setup.scene.camera));
        let blends = self.setup.scene.features & FEATURE_BLEND != 0;
        let problem = if self.primary_plane().is_none() {
            format!("{} has no plane of primary hits; let it find them itself", technique.about().name)
        } else if technique.integral().jitter || camera.lens_radius > 0.0 || blends {
            "hits are given for rays through the centres of pixels; leave out jitter, lens and blended surfaces, or let the \
             technique find them itself"
                .to_owned()
        } else {
            return Ok(());
        };
        Err(Error::PrimaryHits { problem })
    }

    /// The scene, if it changes, and what it lost the history by: then it stands in the session already.
    fn scene_of(
        &mut self,
        change: SceneChange<'_>,
    ) -> Result<(Option<Arc<SceneBuffers>>, Option<&'static str>), Error> {
        let scene = &self.setup.scene;
        match change {
            SceneChange::None => Ok((None, None)),
            SceneChange::Frame(frame) => {
                let moved = if scene.is_animated() { Some(scene.at(frame)?) } else { None };
                Ok((moved.filter(|moved| !moved.is_same(scene)).map(Arc::new), None))
            }
            SceneChange::Edited(edited) => match scene.follow(edited)? {
                Ok(moved) => Ok(((!moved.is_same(scene)).then(|| Arc::new(moved)), None)),
                Err(what) => {
                    // as it stands, not as its animation begins
                    let edited = Scene { animation: Animation::default(), ..edited.clone() };
                    self.set_scene(SceneBuffers::build_editable(&edited)?)?;
                    Ok((None, Some(what)))
                }
            },
        }
    }
}

/// Whether surfaces that are given are of use, and can be addressed.
fn check_surfaces(setup: &Setup, moments: &Moments, sequence: &dyn Sequence) -> Result<(), Error> {
    let Some(GivenPlanes { base, words, .. }) = setup.given(moments) else { return Ok(()) };
    let refuse = |problem: String| Err(Error::PrimaryHits { problem });
    let (last, most) = (u64::from(base) + 2 * u64::from(words), u64::from(u32::MAX));
    if setup.scene.is_foreign() {
        return refuse("a foreign scene knows its surfaces itself; answer for them there".to_owned());
    }
    if setup.denoise.is_some() {
        return refuse("the denoiser looks at the scene, not at surfaces that are given; leave it out".to_owned());
    }
    if sequence.primary(0).is_none() {
        let name = setup.technique.about().name;
        return refuse(format!("{name} has no plane of primary hits, and no use for surfaces; choose restir-di"));
    }
    if last > most {
        let word = WORD as u64;
        return Err(Error::Binding { buffer: "attributes", bytes: last * word, limit: most * word });
    }
    Ok(())
}

/// The kernels of frames to come with their constants: of a first one, of one that is as the last was, and of one that is not.
fn kernels(setup: &Setup, moments: &Moments) -> Result<Vec<Frozen>, Error> {
    // constants are those of dispatches of any length
    let mut sequence = setup.sequence(moments, Dispatches::default());
    let [width, height] = setup.size;
    let camera = setup.scene.camera.params(width, height);
    let mut kernels = Vec::new();
    for (index, same_scene) in [(0, false), (1, true), (2, true), (3, false)] {
        let frame = Frame {
            index,
            samples: setup.samples,
            camera,
            last: (index > 0).then_some(camera),
            scenes: moments.headers(),
            features: setup.features(),
            same_scene,
            primary_given: false,
            clears: false,
            adds: true,
            shows: true,
        };
        let passes = frame_passes(&mut *sequence, frame, None)?;
        kernels.extend(passes.into_iter().map(|pass| (pass.kernel, pass.constants)));
    }
    Ok(kernels)
}

/// The passes of a frame, the first of which begins it.
fn frame_passes(sequence: &mut dyn Sequence, frame: Frame, begun: Option<SceneFrame>) -> Result<Vec<Pass>, Error> {
    sequence.begin(frame);
    let mut passes = std::iter::from_fn(|| sequence.next_pass()).collect::<Result<Vec<_>, _>>()?;
    if let Some(first) = passes.first_mut() {
        first.frame = begun;
    }
    Ok(passes)
}
