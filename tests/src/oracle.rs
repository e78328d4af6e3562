//! An independent path tracer in `f64`, which shares no code with the kernels: brute-force intersection
//! (Möller and Trumbore 1997), scattering alone, no next-event estimation, no weights.

use crate::random::SplitMix;

type Vector = [f64; 3];

/// Hits nearer than this belong to the surface that the ray left.
const NEAR: f64 = 1.0e-9;

/// A triangle with its material. Counter-clockwise is the front side.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners.
    pub vertices: [Vector; 3],
    /// Diffuse reflectance, linear RGB, on both sides.
    pub reflectance: Vector,
    /// Radiance emitted from the front, linear RGB.
    pub emission: Vector,
    /// Emits from the back as well.
    pub two_sided: bool,
}

/// A pinhole camera; `right` and `up` span half of the image at the end of `forward`.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Centre of projection.
    pub position: Vector,
    /// To the centre of the image plane.
    pub forward: Vector,
    /// From there to the middle of the right edge.
    pub right: Vector,
    /// From there to the middle of the upper edge.
    pub up: Vector,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

impl Camera {
    /// The direction through a point of the image, in pixels from the upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> Vector {
        let across = 2.0 * x / f64::from(self.size[0]) - 1.0;
        let along = 1.0 - 2.0 * y / f64::from(self.size[1]);
        unit(add(self.forward, add(scale(self.right, across), scale(self.up, along))))
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
    corner: Vector,
    edges: [Vector; 2],
    normal: Vector,
    triangle: Triangle,
}

impl Face {
    fn new(triangle: Triangle) -> Self {
        let [a, b, c] = triangle.vertices;
        let edges = [sub(b, a), sub(c, a)];
        Self { corner: a, edges, normal: unit(cross(edges[0], edges[1])), triangle }
    }
}

impl Oracle {
    /// A scene and how to look at it.
    pub fn new(triangles: impl IntoIterator<Item = Triangle>, camera: Camera, max_depth: u32, jitter: bool) -> Self {
        Self { faces: triangles.into_iter().map(Face::new).collect(), camera, max_depth, jitter }
    }

    /// One estimate of a pixel's radiance. Estimates of other restarts or pixels are independent.
    pub fn pixel(&self, restart: u32, x: u32, y: u32) -> Vector {
        let stream = (u64::from(restart) << 32) | u64::from(y << 16 | x);
        let random = &mut SplitMix::new(stream);
        let (dx, dy) = if self.jitter { (random.unit(), random.unit()) } else { (0.5, 0.5) };
        let direction = self.camera.direction(f64::from(x) + dx, f64::from(y) + dy);
        self.radiance(self.camera.position, direction, random)
    }

    fn radiance(&self, mut origin: Vector, mut direction: Vector, random: &mut SplitMix) -> Vector {
        let mut sum = [0.0; 3];
        let mut throughput = [1.0; 3];
        for depth in 1..=self.max_depth {
            let Some((face, t)) = self.nearest(origin, direction) else {
                break;
            };
            let (front, triangle) = (face.normal, &face.triangle);
            let from_front = dot(front, direction) < 0.0;
            if from_front || triangle.two_sided {
                sum = add(sum, multiply(throughput, triangle.emission));
            }
            throughput = multiply(throughput, triangle.reflectance);
            if depth == self.max_depth || throughput == [0.0; 3] {
                break;
            }
            origin = add(origin, scale(direction, t));
            direction = cosine_direction(if from_front { front } else { scale(front, -1.0) }, random);
        }
        sum
    }

    fn nearest(&self, origin: Vector, direction: Vector) -> Option<(&Face, f64)> {
        let mut nearest = None;
        let mut limit = f64::INFINITY;
        for face in &self.faces {
            match intersect(face, origin, direction) {
                Some(t) if t > NEAR && t < limit => {
                    limit = t;
                    nearest = Some((face, t));
                }
                _ => {}
            }
        }
        nearest
    }
}

/// The distance to a triangle along a ray, where they meet.
fn intersect(face: &Face, origin: Vector, direction: Vector) -> Option<f64> {
    let [e1, e2] = face.edges;
    let p = cross(direction, e2);
    let inverse = 1.0 / dot(e1, p);
    let s = sub(origin, face.corner);
    let u = dot(s, p) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = cross(s, e1);
    let v = dot(direction, q) * inverse;
    (v >= 0.0 && u + v <= 1.0).then(|| dot(e2, q) * inverse)
}

/// A direction around a normal with density cos / pi: the normal plus a point of the unit sphere.
fn cosine_direction(normal: Vector, random: &mut SplitMix) -> Vector {
    loop {
        let sphere = loop {
            let p = [0.0; 3].map(|_: f64| random.range(-1.0, 1.0));
            let length = dot(p, p);
            if length > 1.0e-6 && length <= 1.0 {
                break unit(p);
            }
        };
        let direction = add(normal, sphere);
        if dot(direction, direction) > 1.0e-12 {
            return unit(direction);
        }
    }
}

fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn multiply(a: Vector, b: Vector) -> Vector {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

fn scale(a: Vector, factor: f64) -> Vector {
    a.map(|x| x * factor)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Vector) -> Vector {
    scale(a, 1.0 / dot(a, a).sqrt())
}
