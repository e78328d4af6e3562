//! An independent path tracer in `f64`, which shares no code with the kernels: brute-force intersection
//! (Möller and Trumbore 1997), scattering alone, no next-event estimation, no weights.

use crate::random::SplitMix;
use glam::DVec3;
use restir_shared::layout::CameraParams;

/// Hits nearer than this belong to the surface that the ray left.
const NEAR: f64 = 1.0e-9;

/// A triangle with its material. Counter-clockwise is the front side.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners.
    pub vertices: [DVec3; 3],
    /// Diffuse reflectance, linear RGB, on both sides.
    pub reflectance: DVec3,
    /// Radiance emitted from the front, linear RGB.
    pub emission: DVec3,
    /// Emits from the back as well.
    pub two_sided: bool,
}

/// A pinhole camera; `right` and `up` span half of the image at the end of `forward`.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Centre of projection.
    pub position: DVec3,
    /// To the centre of the image plane.
    pub forward: DVec3,
    /// From there to the middle of the right edge.
    pub right: DVec3,
    /// From there to the middle of the upper edge.
    pub up: DVec3,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

impl Camera {
    /// The kernels' camera, but for its lens.
    pub fn new(camera: &CameraParams, size: [u32; 2]) -> Self {
        let CameraParams { position, forward, right, up, .. } = *camera;
        let [position, forward, right, up] = [position, forward, right, up].map(|v| DVec3::from(v.map(f64::from)));
        Self { position, forward, right, up, size }
    }

    /// The direction through a point of the image, in pixels from the upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let across = 2.0 * x / f64::from(self.size[0]) - 1.0;
        let along = 1.0 - 2.0 * y / f64::from(self.size[1]);
        (self.forward + self.right * across + self.up * along).normalize()
    }
}

/// What to trace.
#[derive(Clone, Debug)]
pub struct Oracle {
    faces: Vec<Face>,
    /// The camera.
    pub camera: Camera,
    /// Longest path in segments.
    pub max_depth: u32,
    /// Rays go through random points of the pixel instead of its centre.
    pub jitter: bool,
}

/// A triangle with what its intersection needs.
#[derive(Clone, Copy, Debug)]
struct Face {
    edges: [DVec3; 2],
    normal: DVec3,
    triangle: Triangle,
}

impl Face {
    fn new(triangle: Triangle) -> Self {
        let [a, b, c] = triangle.vertices;
        let edges = [b - a, c - a];
        Self { edges, normal: edges[0].cross(edges[1]).normalize(), triangle }
    }

    /// The distance to the triangle along a ray, where they meet.
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [e1, e2] = self.edges;
        let p = direction.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let s = origin - self.triangle.vertices[0];
        let u = s.dot(p) * inverse;
        if !(0.0..=1.0).contains(&u) {
            return None;
        }
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        (v >= 0.0 && u + v <= 1.0 && t > NEAR).then_some(t)
    }
}

impl Oracle {
    /// A scene and how to look at it.
    pub fn new(triangles: impl IntoIterator<Item = Triangle>, camera: Camera, max_depth: u32, jitter: bool) -> Self {
        Self { faces: triangles.into_iter().map(Face::new).collect(), camera, max_depth, jitter }
    }

    /// One estimate of a pixel's radiance. Estimates of other restarts or pixels are independent.
    pub fn pixel(&self, restart: u32, x: u32, y: u32) -> [f64; 3] {
        let stream = (u64::from(restart) << 32) | u64::from(y << 16 | x);
        let random = &mut SplitMix::new(stream);
        let (dx, dy) = if self.jitter { (random.unit(), random.unit()) } else { (0.5, 0.5) };
        let direction = self.camera.direction(f64::from(x) + dx, f64::from(y) + dy);
        self.radiance(self.camera.position, direction, random).into()
    }

    fn radiance(&self, mut origin: DVec3, mut direction: DVec3, random: &mut SplitMix) -> DVec3 {
        let (mut sum, mut throughput) = (DVec3::ZERO, DVec3::ONE);
        for depth in 1..=self.max_depth {
            let Some((face, t)) = self.nearest(origin, direction) else {
                break;
            };
            let from_front = face.normal.dot(direction) < 0.0;
            if from_front || face.triangle.two_sided {
                sum += throughput * face.triangle.emission;
            }
            throughput *= face.triangle.reflectance;
            if depth == self.max_depth || throughput == DVec3::ZERO {
                break;
            }
            origin += direction * t;
            direction = cosine_direction(if from_front { face.normal } else { -face.normal }, random);
        }
        sum
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(&Face, f64)> {
        let hits = self.faces.iter().filter_map(|face| Some((face, face.intersect(origin, direction)?)));
        hits.min_by(|(_, a), (_, b)| a.total_cmp(b))
    }
}

/// A direction around a normal with density cos / pi: the normal plus a point of the unit sphere.
fn cosine_direction(normal: DVec3, random: &mut SplitMix) -> DVec3 {
    loop {
        let sphere = DVec3::from([0.0; 3].map(|_: f64| random.range(-1.0, 1.0)));
        if (1.0e-6..=1.0).contains(&sphere.length_squared())
            && let Some(direction) = (normal + sphere.normalize()).try_normalize()
        {
            return direction;
        }
    }
}
