//! The frames of ReSTIR DI, replayed natively over any scene: one that counts rays, or writes down what it is asked.

use super::still::Still;
use crate::buffers::SceneBuffers;
use crate::di::{DiRender, plan};
use crate::plan::{Buffer, BufferId, Pass};
use restir_kernels as kernels;
use restir_shared::glam::UVec4;
use restir_shared::layout::{DiParams, FilmPixel, TileParams};
use restir_shared::scene::{AddressedLights, Surface, Trace};
use restir_shared::technique::di;

/// The planes of a render, by buffer.
pub struct Frames {
    width: u32,
    planes: Vec<Vec<UVec4>>,
}

impl Frames {
    /// Runs all passes of a render on `scene`, which stands still, whose arenas are those of `buffers`, but for the film. `observe` sees each
    /// pass when it is done.
    pub fn replay<S: Trace + Surface + AddressedLights>(
        scene: &S,
        buffers: &SceneBuffers,
        render: &DiRender,
        observe: &mut dyn FnMut(&Pass, &Self),
    ) -> Self {
        let plan = plan::plan(buffers, render);
        // the arenas are the scene's
        let words = |words: usize| words * size_of::<u32>() / size_of::<UVec4>();
        let plane = |(id, buffer): (usize, &Buffer)| vec![UVec4::ZERO; if id < 3 { 0 } else { words(buffer.words) }];
        let planes = plan.buffers.iter().enumerate().map(plane).collect();
        let mut frames = Self { width: render.width, planes };
        // of a still scene every pass can be made
        for pass in plan.passes.map_while(Result::ok) {
            frames.run(scene, &pass);
            observe(&pass, &frames);
        }
        frames
    }

    /// The words of a plane.
    pub fn plane(&self, id: BufferId) -> &[UVec4] {
        &self.planes[id]
    }

    fn run<S: Trace + Surface + AddressedLights>(&mut self, scene: &S, pass: &Pass) {
        let name = pass.kernel.name;
        if name == kernels::di_tiles::DESC.name {
            self.presample(scene, pass);
        }
        let Ok(p) = bytemuck::try_cast_slice::<u32, DiParams>(&pass.params).map(|all| all[0]) else { return };
        let ids = &pass.bindings;
        if name == kernels::di_primary::DESC.name {
            self.fill(ids[1], |at, _| di::primary(scene, &p, p.flags, at));
        } else if name == kernels::di_initial::DESC.name {
            let [hits, tiles] = [ids[3], ids[4]].map(|id| &self.planes[id]);
            let made: Vec<_> =
                (0..).zip(hits).map(|(i, &hit)| di::initial(scene, &p, p.flags, tiles, hit, self.at(i))).collect();
            self.planes[ids[5]] = made.iter().map(|(reservoir, _)| *reservoir).collect();
            self.planes[ids[6]] = made.iter().map(|(_, direct)| bytemuck::cast(*direct)).collect();
        } else if name == kernels::di_combine::DESC.name {
            let [hits, other_hits, others] = [ids[3], ids[4], ids[5]].map(|id| self.planes[id].clone());
            let planes = di::Planes { hits: &hits, other_hits: &other_hits, others: &others };
            self.fill(ids[6], |at, own| di::combine(&Still(scene), &p, p.flags, &planes, own, at));
        } else if name == kernels::di_shade::DESC.name {
            let [hits, reservoirs, direct] = [ids[3], ids[4], ids[5]].map(|id| self.planes[id].clone());
            let planes = di::Planes { hits: &hits, other_hits: &hits, others: &reservoirs };
            let width = self.width;
            self.fill(ids[6], |at, _| {
                let direct: FilmPixel = bytemuck::cast(direct[(at[1] * width + at[0]) as usize]);
                bytemuck::cast(di::shade(&Still(scene), &p, p.flags, &planes, direct, at))
            });
        }
    }

    fn presample<S: AddressedLights>(&mut self, scene: &S, pass: &Pass) {
        let Ok(&[p]) = bytemuck::try_cast_slice::<u32, TileParams>(&pass.params) else { return };
        let places = (0..p.tiles).flat_map(|tile| (0..p.tile_size).map(move |index| (index, tile)));
        let words: Vec<_> = places.map(|(index, tile)| di::presample(scene, &p, index, tile)).collect();
        self.planes[pass.bindings[3]] = bytemuck::cast_slice(&words).to_vec();
    }

    fn at(&self, index: u32) -> [u32; 2] {
        [index % self.width, index / self.width]
    }

    /// Replaces every word of a plane.
    fn fill(&mut self, id: BufferId, word: impl Fn([u32; 2], UVec4) -> UVec4) {
        self.planes[id] = (0..).zip(&self.planes[id]).map(|(i, &own)| word(self.at(i), own)).collect();
    }
}
