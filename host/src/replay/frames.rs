//! The frames of ReSTIR DI, replayed natively over any scene: one that counts rays, or writes down what it is asked.

use crate::buffers::SceneBuffers;
use crate::di::{DiRender, plan};
use crate::plan::{Buffer, BufferId, Pass};
use restir_kernels as kernels;
use restir_shared::glam::UVec4;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::{AddressedLights, Still, Surface, Trace};
use restir_shared::technique::di;
use restir_shared::technique::di::{DiPairs, DiParams, TileParams};

/// The planes of a render, by buffer.
pub struct Frames {
    width: u32,
    pixels: usize,
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
        let pixels = render.width as usize * render.height as usize;
        let mut frames = Self { width: render.width, pixels, planes };
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
        if name == kernels::di::di_tiles::DESC.name {
            self.presample(scene, pass);
        }
        let Ok(p) = bytemuck::try_cast_slice::<u32, DiParams>(&pass.params).map(|all| all[0]) else { return };
        let ids = &pass.bindings;
        if name == kernels::di::di_primary::DESC.name {
            self.fill(ids[1], |at, _| di::primary(scene, &p, p.flags, at));
        } else if name == kernels::di::di_initial::DESC.name {
            let [hits, tiles] = [ids[3], ids[4]].map(|id| &self.planes[id]);
            let made: Vec<_> =
                (0..).zip(hits).map(|(i, &hit)| di::initial(scene, &p, p.flags, tiles, hit, self.at(i))).collect();
            self.planes[ids[5]] = made.iter().map(|(reservoir, _)| *reservoir).collect();
            self.planes[ids[6]] = made.iter().map(|(_, direct)| bytemuck::cast(*direct)).collect();
        } else if name == kernels::di::di_combine::DESC.name {
            let [hits, other_hits, others] = [ids[3], ids[4], ids[5]].map(|id| self.planes[id].clone());
            let planes = di::Planes { hits: &hits, other_hits: &other_hits, others: &others };
            self.fill(ids[6], |at, own| di::combine(&Still(scene), &p, p.flags, &planes, own, at));
        } else if name == kernels::di::di_shade::DESC.name {
            let [hits, reservoirs, direct] = [ids[3], ids[4], ids[5]].map(|id| self.plane(id));
            self.planes[ids[6]] = self.each(|i, at| {
                bytemuck::cast(di::shade(scene, &p, p.flags, [hits[i], reservoirs[i]], bytemuck::cast(direct[i]), at))
            });
        } else {
            self.run_exchange(scene, pass, &p);
        }
    }

    /// The passes of shading with neighbours.
    fn run_exchange<S: Trace + Surface + AddressedLights>(&mut self, scene: &S, pass: &Pass, p: &DiParams) {
        let (name, ids) = (pass.kernel.name, &pass.bindings);
        if name == kernels::di::di_offer::DESC.name {
            let [hits, reservoirs] = [ids[3], ids[4]].map(|id| self.plane(id));
            let points = self.each(|i, at| di::offer(scene, p, p.flags, [hits[i], reservoirs[i]], at));
            self.planes[ids[5]] = bytemuck::cast_slice(&points).to_vec();
        } else if name == kernels::di::di_exchange::DESC.name {
            let (hits, points) = (self.plane(ids[3]), bytemuck::cast_slice(self.plane(ids[4])));
            let exchanged = self.each(|i, at| di::exchange(scene, p, p.flags, points, hits[i], at));
            let (pairs, sent): (Vec<DiPairs>, Vec<FilmPixel>) = exchanged.into_iter().unzip();
            self.planes[ids[5]] = bytemuck::cast_slice(&pairs).to_vec();
            self.planes[ids[6]] = bytemuck::cast_slice(&sent).to_vec();
        } else if name == kernels::di::di_gather::DESC.name {
            let (points, pairs) = (self.plane(ids[0]), bytemuck::cast_slice(self.plane(ids[1])));
            let points = bytemuck::cast_slice(points);
            let [direct, film] = [ids[2], ids[3]].map(|id| bytemuck::cast_slice::<UVec4, FilmPixel>(self.plane(id)));
            let gathered = self.each(|i, at| di::gather(p, points, pairs, direct[i], film[i], at));
            self.planes[ids[3]] = bytemuck::cast_slice(&gathered).to_vec();
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

    /// Something for every pixel.
    fn each<T>(&self, of: impl Fn(usize, [u32; 2]) -> T) -> Vec<T> {
        (0..self.pixels).map(|i| of(i, self.at(i as u32))).collect()
    }

    /// Replaces every word of a plane.
    fn fill(&mut self, id: BufferId, word: impl Fn([u32; 2], UVec4) -> UVec4) {
        self.planes[id] = (0..).zip(&self.planes[id]).map(|(i, &own)| word(self.at(i), own)).collect();
    }
}
