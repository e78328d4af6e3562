//! One reservoir of several: temporal reuse, spatial reuse, or both at once.

use super::neighbour::{Facet, Place, alike, nearby, project};
use super::pixel::Pixel;
use super::stored::{Stored, dithered};
use super::{COMBINE_DIMENSION, evaluate, in_use};
use super::{
    DI_AVERAGE_VISIBILITY, DI_FINAL_RAY, DI_MIS_SHIFT, DI_MIS_VISIBILITY, DI_OTHER_FRAME, DI_STILL,
    DI_TARGET_VISIBILITY, DI_TRANSMITTANCE, DiParams,
};
use crate::num::{self, Scalar};
use crate::resample::mis::{Combine, INPUTS, Mis};
use crate::resample::reservoir::Reservoir;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLights, Frames, LightAddress};
use crate::transport::transmittance;
use glam::{UVec4, Vec3};

/// The planes that a combine reads.
#[derive(Clone, Copy)]
pub struct Planes<'a> {
    /// Hits of the pixel's frame.
    pub hits: &'a [UVec4],
    /// Hits of the other reservoirs' frame.
    pub other_hits: &'a [UVec4],
    /// The other reservoirs.
    pub others: &'a [UVec4],
}

/// An input: a reservoir and what is known of its sample at the pixel that combines.
#[derive(Clone, Copy)]
struct Input {
    pixel: u32,
    reservoir: UVec4,
    /// Target for the selection.
    target: f32,
    /// Visibility, as far as it was asked for.
    visibility: Vec3,
    /// Near enough for its visibility to be believed.
    near: bool,
}

impl Input {
    const NONE: Self = Self { pixel: 0, reservoir: UVec4::ZERO, target: 0.0, visibility: Vec3::ZERO, near: false };
}

/// Combines the reservoir of the pixel (x, y), `own`, with others; both are packed.
///
/// Targets are a matrix a_j(y_i) of receiving pixels j and samples i, of which the form of MIS asks for some entries. It is
/// gone through row by row, so that each pixel's surface is made once. Pixels of another frame see that frame's scene: what
/// a reservoir can produce was decided there.
pub fn combine<F: Frames>(
    frames: &F,
    params: &DiParams,
    flags: u32,
    planes: &Planes<'_>,
    own: UVec4,
    at: [u32; 2],
) -> UVec4 {
    combine_from(frames, params, flags, planes, own, at).0
}

/// As [`combine`], with the reservoir that the sample comes from.
#[inline(always)]
pub fn combine_from<F: Frames>(
    frames: &F,
    params: &DiParams,
    flags: u32,
    planes: &Planes<'_>,
    own: UVec4,
    at: [u32; 2],
) -> (UVec4, Source) {
    let flags = in_use(flags, &frames.scene(false));
    let pass = Pass { params, flags, planes, form: Mis((flags >> DI_MIS_SHIFT) & Mis::MASK) };
    pass.run(frames, own, at)
}

/// Which reservoir a combine has selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// One of the others, not the pixel's own.
    pub is_other: bool,
    /// Index of its pixel.
    pub pixel: u32,
}

/// What all of a combine has in common.
#[derive(Clone, Copy)]
struct Pass<'a> {
    params: &'a DiParams,
    flags: u32,
    planes: &'a Planes<'a>,
    form: Mis,
}

impl Pass<'_> {
    #[inline(always)]
    fn run<F: Frames>(&self, frames: &F, own: UVec4, [x, y]: [u32; 2]) -> (UVec4, Source) {
        let p = self.params;
        let at = y * p.width + x;
        let canonical = if self.has(DI_OTHER_FRAME) { own } else { self.planes.others[at as usize] };
        let unchanged = (canonical, Source { is_other: false, pixel: at });
        let pixel = Pixel::new(&p.camera, self.flags, p.seed, p.frame, [x, y], self.planes.hits[at as usize]);
        if !pixel.hit.is_hit() {
            return unchanged;
        }
        let rng = Rng::new(x, y, p.frame, p.seed);
        let dimension = COMBINE_DIMENSION.wrapping_add(p.combine.wrapping_mul(2));
        let mut inputs = [Input::NONE; INPUTS];
        inputs[0] = Input { pixel: at, reservoir: canonical, ..Input::NONE };
        let count = self.gather(frames, &pixel, [x, y], rng.draw(dimension), &mut inputs);
        if count == 1 {
            // alone it stays as it is, without a rounding
            return unchanged;
        }
        let words = rng.draw(dimension.wrapping_add(1));
        self.resample(frames, &pixel, &mut inputs, count, [rng::unit(words.x), rng::unit(words.y)])
    }

    #[inline(always)]
    fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// A pixel among the others.
    #[inline(always)]
    fn other(&self, [x, y]: [u32; 2]) -> Pixel {
        let p = self.params;
        let (camera, frame) =
            if self.has(DI_OTHER_FRAME) { (p.other_camera, p.other_frame) } else { (p.camera, p.frame) };
        let hit = self.planes.other_hits[(y * p.width + x) as usize];
        Pixel::new(&camera, self.flags, p.seed, frame, [x, y], hit)
    }

    /// Fills in the inputs after the canonical one, and returns how many there are with it. What is rejected is none of
    /// them.
    #[inline(always)]
    fn gather<F: Frames>(
        &self,
        frames: &F,
        pixel: &Pixel,
        [x, y]: [u32; 2],
        words: UVec4,
        inputs: &mut [Input; INPUTS],
    ) -> u32 {
        let p = self.params;
        if self.has(DI_STILL) {
            let at = y * p.width + x;
            let reservoir = self.planes.others[at as usize];
            inputs[1] = Input { pixel: at, reservoir, near: true, ..Input::NONE };
            return if Stored::unpack(reservoir).confidence > 0.0 { 2 } else { 1 };
        }
        // the pixel's surface as it was when the others saw it
        let scene = frames.scene(self.has(DI_OTHER_FRAME));
        let here = Facet::of(&pixel.point(&scene));
        let center = if self.has(DI_OTHER_FRAME) {
            project(&p.other_camera, p, here.position)
        } else {
            Place { x, y, inside: true }
        };
        let mut count = 1_u32;
        // the first place is the centre, which is a neighbour in another frame only
        let mut n = if self.has(DI_OTHER_FRAME) { 0 } else { 1 };
        while n <= p.neighbours {
            let place = if n == 0 { center } else { nearby(p, center, n, words) };
            let is_center = (place.x == center.x) & (place.y == center.y);
            if place.inside & ((n == 0) | !is_center) {
                let at = place.y * p.width + place.x;
                let reservoir = self.planes.others[at as usize];
                let other = self.other([place.x, place.y]);
                let counts = Stored::unpack(reservoir).confidence > 0.0;
                if other.hit.is_hit() && counts && alike(p, pixel.hit.t, &here, &Facet::of(&other.point(&scene))) {
                    let near = (n == 0) | place.is_near(&center, p.near_radius);
                    inputs[count as usize] = Input { pixel: at, reservoir, near, ..Input::NONE };
                    count = count.wrapping_add(1);
                }
            }
            n = n.wrapping_add(1);
        }
        count
    }

    /// An input's reservoir: one of another frame counts at most as much as the cap says.
    #[inline(always)]
    fn load(&self, input: &Input, index: u32) -> Stored {
        let stored = Stored::unpack(input.reservoir);
        let capped = self.is_elsewhere(index);
        let cap = self.params.confidence_cap;
        Stored { confidence: if capped { num::min(stored.confidence, cap) } else { stored.confidence }, ..stored }
    }

    /// Whether an input, or the pixel that it came from, is of another frame.
    #[inline(always)]
    fn is_elsewhere(&self, index: u32) -> bool {
        self.has(DI_OTHER_FRAME) & (index != 0)
    }

    /// The address of an input's sample among the lights of this frame or, `elsewhere`, of the other one.
    #[inline(always)]
    fn address<F: Frames>(&self, frames: &F, address: LightAddress, index: u32, elsewhere: bool) -> LightAddress {
        let of_other = self.is_elsewhere(index);
        if of_other == elsewhere { address } else { frames.counterpart(address, of_other) }
    }

    #[inline(always)]
    fn resample<F: Frames>(
        &self,
        frames: &F,
        pixel: &Pixel,
        inputs: &mut [Input; INPUTS],
        count: u32,
        [u, dither]: [f32; 2],
    ) -> (UVec4, Source) {
        let form = self.form;
        let in_target = self.has(DI_TARGET_VISIBILITY);
        let in_mis = self.has(DI_MIS_VISIBILITY);
        // what a reservoir keeps of a colour is not good enough for MIS
        let forgets = in_mis & self.has(DI_TRANSMITTANCE);
        // shading will take the visibility that is kept, and nothing else asks for it
        let for_shading = !in_mis & !self.has(DI_FINAL_RAY);
        let late = form.asks_for_selected();
        // the pixel itself, the others, and for the visibility of the selected sample the pixel once more
        let again = late & in_mis & !in_target;
        let rows = if late | form.asks_for_pairs() { count } else { 1 }.wrapping_add(if again { 1 } else { 0 });
        let selects_at = if form.is_after_selection() { 0 } else { rows.wrapping_sub(1) };
        let asked = self.params.neighbours.wrapping_add(if self.has(DI_OTHER_FRAME) { 1 } else { 0 });
        let mut combine = Combine::new(form, asked as f32);
        let mut selection = Selection::NONE;
        let mut row = 0;
        while row < rows {
            let receiver = if row == count { 0 } else { row };
            let width = self.params.width;
            let at = inputs[receiver as usize].pixel;
            let seen = if receiver == 0 { *pixel } else { self.other([at % width, at / width]) };
            let elsewhere = self.is_elsewhere(receiver);
            let scene = frames.scene(elsewhere);
            let vertex = seen.vertex(&scene);
            let mut i = 0_u32;
            while i < count {
                let input = inputs[i as usize];
                let stored = self.load(&input, i);
                let is_selected = late & (row > 0) & (i == selection.input);
                let address = self.address(frames, stored.address, i, elsewhere);
                let mut target = 0.0;
                let mut visible_target = 0.0;
                let mut visibility = stored.visibility;
                if ((row == 0) | is_selected | form.asks_for(receiver, i)) & stored.has_sample() & address.is_light() {
                    let e = evaluate(self.flags, &vertex, &scene.light_at(address));
                    target = e.target;
                    let asked =
                        if row == 0 { in_target | (in_mis & !late) | (for_shading & !input.near) } else { in_mis };
                    // of its own sample a pixel knows
                    let own = (receiver == i) | self.has(DI_STILL);
                    if asked & (!own | forgets) & (target > 0.0) {
                        visibility = transmittance(&scene, self.flags & DI_TRANSMITTANCE != 0, &e.shadow);
                    }
                    visible_target = e.visible_target(visibility, self.flags);
                }
                let a = if in_mis { visible_target } else { target };
                if row == 0 {
                    // what is known to be occluded at a pixel is no sample of its own
                    let p = if in_target | (in_mis & self.has(DI_STILL)) { a } else { target };
                    combine.input(stored.confidence, (p * stored.contribution_weight).within_range());
                    inputs[i as usize].target = p;
                    inputs[i as usize].visibility = visibility;
                }
                if is_selected {
                    combine.selected_target(receiver, i, a);
                    selection.visibility = if receiver == 0 { visibility } else { selection.visibility };
                } else if form.asks_for(receiver, i) {
                    combine.target(receiver, i, a);
                }
                i = i.wrapping_add(1);
            }
            if row == selects_at {
                selection = select(&combine, inputs, count, u);
                if late & !again {
                    combine.selected_target(0, selection.input, selection.target);
                }
            }
            row = row.wrapping_add(1);
        }
        let average = for_shading & self.has(DI_AVERAGE_VISIBILITY);
        let kept = Stored::unpack(inputs[selection.input as usize].reservoir);
        let reservoir = Reservoir { sample: (), weight_sum: selection.weight_sum, confidence: combine.confidence() };
        let stored = Stored {
            address: self.address(frames, kept.address, selection.input, false),
            contribution_weight: reservoir.contribution_weight(combine.share(), selection.target),
            confidence: reservoir.confidence,
            visibility: dithered(if average { selection.mean_visibility } else { selection.visibility }, dither),
        };
        let source = Source { is_other: selection.input != 0, pixel: inputs[selection.input as usize].pixel };
        (stored.pack(), source)
    }
}

/// The outcome of a selection.
#[derive(Clone, Copy)]
struct Selection {
    input: u32,
    target: f32,
    visibility: Vec3,
    weight_sum: f32,
    /// Of all inputs, by weight (Tokuyoshi, eq. 4).
    mean_visibility: Vec3,
}

impl Selection {
    const NONE: Self =
        Self { input: 0, target: 0.0, visibility: Vec3::ZERO, weight_sum: 0.0, mean_visibility: Vec3::ZERO };
}

/// Selects an input in proportion to its weight by one random number.
#[inline(always)]
fn select(combine: &Combine<f32>, inputs: &[Input; INPUTS], count: u32, u: f32) -> Selection {
    let mut weights = [0.0; INPUTS];
    let mut sum = 0.0;
    let mut visible = Vec3::ZERO;
    let mut i = 0;
    while i < count {
        let weight = combine.weight(i);
        weights[i as usize] = weight;
        sum += weight;
        visible += inputs[i as usize].visibility * weight;
        i = i.wrapping_add(1);
    }
    let mut chosen = 0;
    let mut below = 0.0;
    let mut open = true;
    i = 0;
    while i < count {
        below += weights[i as usize];
        let here = open & (u * sum < below);
        chosen = if here { i } else { chosen };
        open &= !here;
        i = i.wrapping_add(1);
    }
    let share = |visible: f32| if sum > 0.0 { num::clamp(num::div(visible, sum), 0.0, 1.0) } else { 0.0 };
    let input = inputs[chosen as usize];
    Selection {
        input: chosen,
        target: input.target,
        visibility: input.visibility,
        weight_sum: sum,
        mean_visibility: Vec3::new(share(visible.x), share(visible.y), share(visible.z)),
    }
}
