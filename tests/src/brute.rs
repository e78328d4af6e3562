//! Intersection without a hierarchy, and hierarchies that are traversed wrongly.

use glam::{UVec4, Vec3};
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Slab, TriangleTest};
use restir_shared::layout::{
    LEAF, LEAF_COUNT_SHIFT, LEAF_MAX_COUNT, MAX_TRIANGLES, NODE_WORDS, NONE, TRIANGLE_ALPHA, TRIANGLE_WORDS,
};
use restir_shared::scene::SceneView;
use std::cell::RefCell;

/// Hits as a probe gives them.
fn listed(mut hits: Vec<Hit>) -> Crossings {
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.id.cmp(&b.id)));
    let nearest = std::array::from_fn(|place| hits.get(place).copied().unwrap_or(Hit::MISS));
    Crossings { count: hits.len() as u32, nearest }
}

fn xyz(word: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(word.x), f32::from_bits(word.y), f32::from_bits(word.z))
}

/// The triangles of a scene, in the order of their ids.
#[derive(Clone, Copy)]
pub struct Triangles<'a> {
    view: SceneView<'a>,
}

impl<'a> Triangles<'a> {
    /// Of a scene.
    pub fn new(view: SceneView<'a>) -> Self {
        Self { view }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.view.header.triangle_count as usize
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Corners.
    pub fn get(&self, id: usize) -> [Vec3; 3] {
        let at = (self.view.header.triangle_base + id as u32 * TRIANGLE_WORDS) as usize;
        [0, 1, 2].map(|corner| xyz(self.view.geometry[at + corner]))
    }

    /// The largest side of the bounds.
    pub fn extent(&self) -> f32 {
        let [lo, hi] = self.bounds();
        (hi - lo).max_element()
    }

    /// Lower and upper corner.
    pub fn bounds(&self) -> [Vec3; 2] {
        let header = &self.view.header;
        [header.bounds_lo, header.bounds_hi].map(Vec3::from_array)
    }

    /// The ray as the intersector wants it.
    pub fn slab(&self, ray: &Ray) -> Slab {
        let [lo, hi] = self.bounds();
        Slab::new(ray, lo, hi)
    }

    /// The hit of one triangle, if it counts.
    fn hit(&self, ray: &Ray, test: &TriangleTest, slab: &Slab, id: usize) -> Hit {
        let [a, b, c] = self.get(id);
        let hit = test.hit(slab, id as u32, a, b, c);
        if hit.is_hit() && self.is_marked(id) && !self.view.covers(ray, &hit) { Hit::MISS } else { hit }
    }

    /// Whether rays may miss a triangle that they hit.
    fn is_marked(&self, id: usize) -> bool {
        self.view.geometry[self.view.header.triangle_word(id as u32) + 2].w & TRIANGLE_ALPHA != 0
    }

    /// The closest hit over all triangles: its definition.
    pub fn closest(&self, ray: &Ray) -> Hit {
        let (test, slab) = (TriangleTest::new(ray), self.slab(ray));
        let hits = (0..self.len()).map(|id| self.hit(ray, &test, &slab, id));
        let hits = hits.filter(|hit| hit.is_hit() && hit.t < ray.t_max);
        // of equal ones the first, which has the lowest id
        hits.min_by(|a, b| a.t.partial_cmp(&b.t).expect("a distance is a number")).unwrap_or(Hit::MISS)
    }

    /// The object of a triangle.
    pub fn object(&self, id: usize) -> u32 {
        self.view.geometry[self.view.header.triangle_word(id as u32) + 2].w & !TRIANGLE_ALPHA
    }

    /// All hits of an object: the definition of a probe. They are sorted, not inserted.
    pub fn crossings(&self, ray: &Ray, object: u32) -> Crossings {
        let (test, slab) = (TriangleTest::new(ray), self.slab(ray));
        let ids = (0..self.len()).filter(|&id| self.object(id) == object);
        listed(ids.map(|id| self.hit(ray, &test, &slab, id)).filter(|hit| hit.is_hit() && hit.t < ray.t_max).collect())
    }

    /// Wrong: through boxes without padding.
    pub fn crossings_in_tight_boxes(&self, ray: &Ray, object: u32) -> Crossings {
        let hits = RefCell::new(Vec::new());
        self.any(ray, &Slab::new(ray, ray.origin, ray.origin), |hit| {
            let belongs = self.object(hit.id as usize) == object;
            hits.borrow_mut().extend(belongs.then_some(*hit));
            false
        });
        listed(hits.into_inner())
    }

    /// Whether some node or triangle of the hierarchy that `boxes` does not cull passes `rule` and is hit: a traversal
    /// of our own, in no particular order.
    fn any(&self, ray: &Ray, boxes: &Slab, rule: impl Fn(&Hit) -> bool) -> bool {
        let (test, slab) = (TriangleTest::new(ray), self.slab(ray));
        let mut pending = vec![self.view.header.root];
        while let Some(node) = pending.pop() {
            if node == NONE {
                continue;
            }
            if node & LEAF != 0 {
                let first = (node & (MAX_TRIANGLES - 1)) as usize;
                let count = ((node >> LEAF_COUNT_SHIFT) & LEAF_MAX_COUNT) as usize;
                let mut hits = (first..first + count).map(|id| self.hit(ray, &test, &slab, id));
                if hits.any(|hit| hit.is_hit() && hit.t < ray.t_max && rule(&hit)) {
                    return true;
                }
                continue;
            }
            let at = (self.view.header.node_base + node * NODE_WORDS) as usize;
            let words = &self.view.geometry[at..at + NODE_WORDS as usize];
            for (lo, hi, child) in [(words[0], words[1], words[0].w), (words[2], words[3], words[1].w)] {
                let (enter, exit) = boxes.interval(xyz(lo), xyz(hi));
                if enter <= exit {
                    pending.push(child);
                }
            }
        }
        false
    }

    /// Any hit, traversed as the kernels do: padded boxes, edges belong to both sides.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.any(ray, &self.slab(ray), |_| true)
    }

    /// Wrong: boxes without padding.
    pub fn any_hit_in_tight_boxes(&self, ray: &Ray) -> bool {
        // without any reach there is no padding
        self.any(ray, &Slab::new(ray, ray.origin, ray.origin), |_| true)
    }

    /// Wrong: edges belong to neither side.
    pub fn any_hit_with_open_edges(&self, ray: &Ray) -> bool {
        self.any(ray, &self.slab(ray), |hit| hit.uv.x > 0.0 && hit.uv.y > 0.0)
    }
}
