//! Frames of ReSTIR DI, pass by pass, natively over any scene and with any flags: also with those that the host refuses.

use restir_host::buffers::SceneBuffers;
use restir_host::di::DiSettings;
use restir_shared::glam::UVec4;
use restir_shared::layout::FilmPixel;
use restir_shared::num;
use restir_shared::scene::{AddressedLights, Still, Surface, Trace};
use restir_shared::technique::di;
use restir_shared::technique::di::{DiParams, DiPoint, TileWords};

/// A static camera before a scene, and settings, of which the next frame reuses what spatial reuse has made.
pub struct Chain<'a, S> {
    /// What is asked.
    pub scene: &'a S,
    /// Of a frame's first pass; frame 0.
    pub params: DiParams,
    /// The last frame is reused.
    pub temporal: bool,
    /// Passes of spatial reuse.
    pub spatial: u32,
    /// One pass for both.
    pub fused: bool,
    /// Which neighbours are shaded.
    pub settings: DiSettings,
    /// Flags of the combine with the frame before.
    pub temporal_flags: u32,
}

/// The planes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Index in the chain.
    pub index: u32,
    /// What pixels see.
    pub hits: Vec<UVec4>,
    /// Reservoirs.
    pub reservoirs: Vec<UVec4>,
    /// What needs no resampling.
    pub direct: Vec<FilmPixel>,
}

impl<'a, S: Trace + Surface + AddressedLights> Chain<'a, S> {
    /// The settings' chain over `scene`, which is `buffers` or asks it.
    pub fn new(scene: &'a S, buffers: &SceneBuffers, [width, height]: [u32; 2], s: &DiSettings, seed: u32) -> Self {
        let camera = buffers.camera.params(width, height);
        let params = DiParams {
            scene: buffers.header,
            other_scene: buffers.header,
            camera,
            other_camera: camera,
            width,
            height,
            seed,
            flags: s.flags(),
            candidates: s.candidates,
            neighbours: s.neighbours,
            confidence_cap: s.confidence_cap as f32,
            radius: s.radius,
            near_radius: s.near_radius,
            max_plane_distance: s.max_plane_distance,
            min_normal_cos: s.min_normal_cos,
            group: s.candidates_per_ray(),
            tiles: s.tiles,
            tile_size: s.tile_size,
            ..DiParams::default()
        };
        Self {
            scene,
            params,
            temporal: s.temporal,
            spatial: s.spatial,
            fused: s.fused,
            settings: s.clone(),
            temporal_flags: s.temporal_flags(true),
        }
    }

    /// All pixels, rows from top to bottom.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<S> {
        let (width, height) = (self.params.width, self.params.height);
        (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
    }

    fn of_frame(&self, index: u32) -> DiParams {
        DiParams { frame: index, other_frame: index, ..self.params }
    }

    /// A frame before any reuse.
    pub fn initial(&self, index: u32) -> Frame {
        let p = self.of_frame(index);
        let hits: Vec<UVec4> = self.pixels().map(|at| di::primary(self.scene, &p, p.flags, at)).collect();
        let tiles = self.tiles(&p);
        let tiles = bytemuck::cast_slice(&tiles);
        let initial = self.pixels().zip(&hits).map(|(at, &hit)| di::initial(self.scene, &p, p.flags, tiles, hit, at));
        let (reservoirs, direct) = initial.unzip();
        Frame { index, hits, reservoirs, direct }
    }

    fn tiles(&self, p: &DiParams) -> Vec<TileWords> {
        let params = p.tile_params();
        let places = (0..p.tiles).flat_map(|tile| (0..p.tile_size).map(move |index| (index, tile)));
        places.map(|(index, tile)| di::presample(self.scene, &params, index, tile)).collect()
    }

    /// The parameters and the planes of a combine with the frame before, for one pixel.
    pub fn temporal_pixel(&self, frame: &Frame, last: &Frame, at: [u32; 2]) -> UVec4 {
        let p = DiParams {
            flags: self.temporal_flags,
            other_frame: last.index,
            neighbours: if self.fused { self.params.neighbours } else { 0 },
            ..self.of_frame(frame.index)
        };
        let planes = di::Planes { hits: &frame.hits, other_hits: &last.hits, others: &last.reservoirs };
        let own = frame.reservoirs[(at[1] * p.width + at[0]) as usize];
        di::combine(Still(self.scene), &p, p.flags, &planes, own, at)
    }

    /// A pixel of a spatial pass.
    pub fn spatial_pixel(&self, frame: &Frame, pass: u32, at: [u32; 2]) -> UVec4 {
        let p = DiParams { combine: 1 + pass, ..self.of_frame(frame.index) };
        let planes = di::Planes { hits: &frame.hits, other_hits: &frame.hits, others: &frame.reservoirs };
        di::combine(Still(self.scene), &p, p.flags, &planes, UVec4::ZERO, at)
    }

    /// What the pixels of a frame show their neighbours.
    pub fn points(&self, frame: &Frame) -> Vec<DiPoint> {
        let p = self.of_frame(frame.index);
        self.words(frame).map(|(at, words)| di::offer(self.scene, &p, p.flags, words, at)).collect()
    }

    /// The picture of a frame: the mean of as many passes as its neighbours take, summed as the film sums them.
    pub fn shade(&self, frame: &Frame) -> Vec<FilmPixel> {
        let points = if self.settings.shaded > 0 { self.points(frame) } else { Vec::new() };
        let passes = self.settings.shading(&self.of_frame(frame.index));
        let pictures: Vec<_> = passes.iter().map(|p| self.shading_pass(frame, p, &points)).collect();
        let mean = |pixel: usize| {
            let mut sums: Vec<(u32, FilmPixel)> = Vec::new();
            for (picture, left) in pictures.iter().zip((0..pictures.len()).rev()) {
                sums.push((0, picture[pixel]));
                while let &[.., (first, a), (second, b)] = sums.as_slice()
                    && (first == second || left == 0)
                {
                    sums.truncate(sums.len() - 2);
                    sums.push((first + 1, a.merge(b)));
                }
            }
            let sum = sums.first().map_or_else(FilmPixel::default, |&(_, sum)| sum);
            FilmPixel { sum: sum.sum.map(|value| num::div(value, pictures.len() as f32)), dropped: sum.dropped }
        };
        (0..frame.hits.len()).map(mean).collect()
    }

    fn shading_pass(&self, frame: &Frame, p: &DiParams, points: &[DiPoint]) -> Vec<FilmPixel> {
        if points.is_empty() {
            return self.pixels().map(|at| self.shade_alone(frame, at)).collect();
        }
        let (pairs, sent): (Vec<_>, Vec<_>) =
            self.words(frame).map(|(at, [hit, _])| di::exchange(self.scene, p, p.flags, points, hit, at)).unzip();
        let pixels = self.pixels().zip(frame.direct.iter().zip(sent));
        pixels.map(|(at, (&direct, sent))| di::gather(p, points, &pairs, direct, sent, at)).collect()
    }

    /// A pixel by way of its own reservoir.
    pub fn shade_alone(&self, frame: &Frame, [x, y]: [u32; 2]) -> FilmPixel {
        let p = self.of_frame(frame.index);
        let i = (y * p.width + x) as usize;
        di::shade(self.scene, &p, p.flags, [frame.hits[i], frame.reservoirs[i]], frame.direct[i], [x, y])
    }

    /// Each pixel's hit and reservoir.
    fn words<'b>(&self, frame: &'b Frame) -> impl Iterator<Item = ([u32; 2], [UVec4; 2])> + use<'b, S> {
        let words = frame.hits.iter().zip(&frame.reservoirs).map(|(&hit, &reservoir)| [hit, reservoir]);
        self.pixels().zip(words)
    }

    /// A frame with all reuse.
    pub fn frame(&self, index: u32, last: Option<&Frame>) -> Frame {
        let mut frame = self.initial(index);
        if let Some(last) = last.filter(|_| self.temporal) {
            frame.reservoirs = self.pixels().map(|at| self.temporal_pixel(&frame, last, at)).collect();
        }
        for pass in 0..if self.fused { 0 } else { self.spatial } {
            frame.reservoirs = self.pixels().map(|at| self.spatial_pixel(&frame, pass, at)).collect();
        }
        frame
    }

    /// The last of a number of frames.
    pub fn last_frame(&self, frames: u32) -> Frame {
        (1..frames).fold(self.frame(0, None), |last, index| self.frame(index, Some(&last)))
    }

    /// The picture of the last frame.
    pub fn film(&self, frames: u32) -> Vec<FilmPixel> {
        let frame = self.last_frame(frames);
        self.shade(&frame)
    }
}
