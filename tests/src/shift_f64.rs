//! Reconnections again in `f64`, from the formulas of Lin et al. 2022: densities of lobes by [`Shadow`], solid angles and areas by
//! points and normals, and Jacobians by differences of the random numbers themselves.

use crate::bsdf_f64::Shadow;
use crate::random::SplitMix;
use glam::DVec3;
use restir_shared::bsdf::{Bsdf, Kind, LOBES, Material, is_specular, is_transmission};
use restir_shared::layout::{FEATURE_MULTISCATTER, FEATURES_ALL};
use restir_shared::scene::SurfacePoint;
use std::f64::consts::TAU;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Where it is.
    pub position: DVec3,
    /// Unit geometric normal of the front.
    pub normal: DVec3,
    shading: DVec3,
    material: Material,
    offset: f64,
}

/// A point of a surface, seen along a direction: a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    corner: Corner,
    frame: [DVec3; 3],
    shadow: Shadow,
    /// Probabilities of the lobes.
    selections: [f64; LOBES as usize],
    perfect: [bool; LOBES as usize],
}

impl Corner {
    /// The same point as the kernels have it.
    pub fn new(point: &SurfacePoint) -> Self {
        Self {
            position: point.position.as_dvec3(),
            normal: point.normal.as_dvec3().normalize(),
            shading: point.shading_normal.as_dvec3().normalize(),
            material: point.material,
            offset: f64::from(point.offset),
        }
    }

    /// The end of a segment of that unit direction, whose probabilities of lobes are those of `bsdf`: these are multiples of 2^-20,
    /// and `f64` would round other ones.
    pub fn seen(&self, direction: DVec3, bsdf: &Bsdf, features: u32) -> Seen {
        let front = self.normal.dot(direction) <= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let (normal, wo) = (self.normal * side, -direction);
        let axis = facing(self.shading * side, normal, wo);
        let (s, t) = axis.any_orthonormal_pair();
        let local = DVec3::new(s.dot(wo), t.dot(wo), axis.dot(wo));
        let multiscatter = features & FEATURE_MULTISCATTER != 0;
        let shadow = Shadow::new(&self.material, local.as_vec3(), front, multiscatter).seen_from(local);
        let of_lobes = |lobe: usize| (f64::from(bsdf.selection(lobe as u32)), bsdf.kind(lobe as u32) == Kind::Delta);
        Seen {
            corner: *self,
            frame: [s, t, axis],
            shadow,
            selections: std::array::from_fn(|lobe| of_lobes(lobe).0),
            perfect: std::array::from_fn(|lobe| of_lobes(lobe).1),
        }
    }

    /// [`Self::seen`] with all features and the probabilities that belong to the direction, unless its cosine is below `least`.
    fn seen_along(&self, direction: DVec3, least: f64) -> Option<Seen> {
        let front = self.normal.dot(direction) <= 0.0;
        let cos = self.normal.dot(direction).abs();
        let wo = DVec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
        let bsdf = Bsdf::new(&self.material, wo.as_vec3(), front, FEATURES_ALL);
        (cos > least).then(|| self.seen(direction, &bsdf, FEATURES_ALL))
    }

    /// Where a segment of that direction begins or ends: off the surface.
    fn origin(&self, direction: DVec3) -> DVec3 {
        self.position + self.normal * self.offset.copysign(self.normal.dot(direction))
    }

    /// Where the ray meets the plane of this corner.
    fn at(&self, origin: DVec3, direction: DVec3) -> Option<Self> {
        let t = self.normal.dot(self.position - origin) / self.normal.dot(direction);
        (t > 0.05 && t < 50.0).then(|| Self { position: origin + direction * t, ..*self })
    }
}

/// The smallest cosine of configurations that are not said to be grazing: differences are good to 10^-6 there.
pub const PLAIN: f64 = 0.1;

/// As the kernels bend a shading normal that turns away from the viewer.
fn facing(shading: DVec3, geometric: DVec3, wo: DVec3) -> DVec3 {
    let (cos, least) = (shading.dot(wo), geometric.dot(wo).min(0.01));
    if cos < least { (shading + wo * (least - cos)).normalize() } else { shading }
}

impl Seen {
    fn local(&self, direction: DVec3) -> DVec3 {
        let [s, t, n] = self.frame;
        DVec3::new(s.dot(direction), t.dot(direction), n.dot(direction))
    }

    /// The cosine between a direction and the shading normal, on either side.
    pub fn cos(&self, direction: DVec3) -> f64 {
        self.local(direction).z.abs()
    }

    /// Whether the densities of its lobes are known here: metal and coats do not transmit, and glass does nothing else.
    pub fn is_known(&self) -> bool {
        let clear = self.shadow.clear_share();
        clear == 0.0 || clear == 1.0
    }

    /// `f |cos|` of all lobes.
    pub fn value(&self, direction: DVec3) -> DVec3 {
        let wi = self.local(direction);
        let rough = |lobe: &u32| !self.perfect[*lobe as usize];
        (0..LOBES).filter(rough).map(|lobe| self.shadow.value(lobe, wi)).sum()
    }

    /// Density of a direction together with the lobe.
    pub fn pdf(&self, lobe: u32, direction: DVec3) -> f64 {
        let wi = self.local(direction);
        if is_transmission(lobe) != (wi.z < 0.0) || self.perfect[lobe as usize] {
            return 0.0;
        }
        let given =
            if is_specular(lobe) { self.shadow.pdf(lobe, wi) } else { wi.z.abs() * std::f64::consts::FRAC_1_PI };
        given * self.chance(lobe, wi)
    }

    /// The probability of the lobe, of a specular one given the facet that makes it.
    fn chance(&self, lobe: u32, wi: DVec3) -> f64 {
        let selection = self.selections[lobe as usize];
        if self.shadow.clear_share() == 0.0 || !is_specular(lobe) {
            return selection;
        }
        let reflected = self.shadow.fresnel(wi);
        selection * if is_transmission(lobe) { 1.0 - reflected } else { reflected }
    }

    /// Density of a direction over all lobes.
    pub fn pdf_of_all(&self, direction: DVec3) -> f64 {
        (0..LOBES).map(|lobe| self.pdf(lobe, direction)).sum()
    }

    /// The direction that a lobe makes of two numbers, unless its cosine is below `least`.
    fn direction(&self, lobe: u32, u: [f64; 2], least: f64) -> Option<DVec3> {
        // what is reflected below the horizon of a surface that is not clear goes nowhere
        if self.has_caps(lobe) && is_transmission(lobe) {
            return None;
        }
        let wi = if self.has_caps(lobe) { self.shadow.reflected(u) } else { self.shadow.direction(lobe, u)? };
        let [s, t, n] = self.frame;
        let right_side = is_transmission(lobe) == (wi.z < 0.0) && wi.z.abs() > least;
        right_side.then(|| s * wi.x + t * wi.y + n * wi.z)
    }

    /// The numbers of which a lobe makes the direction.
    fn coordinates(&self, lobe: u32, direction: DVec3) -> [f64; 2] {
        let wi = self.local(direction);
        if self.has_caps(lobe) { self.shadow.coordinates_of_reflected(wi) } else { self.shadow.coordinates(lobe, wi) }
    }

    fn has_caps(&self, lobe: u32) -> bool {
        is_specular(lobe) && self.shadow.clear_share() == 0.0
    }
}

/// A segment from a vertex to a point.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    /// Its unit direction.
    pub direction: DVec3,
    /// Its length, from where it leaves the surface.
    pub distance: f64,
}

impl Leg {
    /// To infinity.
    pub fn far(direction: DVec3) -> Self {
        Self { direction: direction.normalize(), distance: f64::INFINITY }
    }

    /// From a vertex to a point of a surface.
    pub fn new(from: &Seen, to: DVec3) -> Self {
        let way = to - from.corner.origin(to - from.corner.position);
        Self { direction: way.normalize(), distance: way.length() }
    }

    /// G, solid angle at the vertex per area at a point with that normal.
    pub fn per_area(&self, normal: DVec3) -> f64 {
        normal.dot(self.direction).abs() / self.distance.powi(2)
    }
}

/// What a path does after its reconnection vertex, or that this is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Case {
    /// A: a direction is drawn there.
    Drawn,
    /// A': it finds the light, a point of a surface.
    Found,
    /// B, and C: numbers decide up to there, and what follows is kept whatever came before.
    Kept,
    /// E: a direction of the environment, that is drawn at the vertex before.
    Environment,
    /// A replayed vertex before what [`Self::Kept`] has: the same numbers give another one from the other start.
    Replayed,
    /// D: a point of a triangle that the table of lights gives, which may have another form and another share of the table in the other
    /// frame.
    Light,
    /// F: the same of a cell of the environment, which stays where it is.
    Cell,
    /// H: the same of a light that is a point.
    Point,
    /// G: nothing is kept but the numbers.
    Numbers,
}

impl Case {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Drawn,
        Self::Found,
        Self::Kept,
        Self::Environment,
        Self::Replayed,
        Self::Light,
        Self::Cell,
        Self::Point,
        Self::Numbers,
    ];
}

/// Ways to get the Jacobian wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// It is left out.
    LeftOut,
    /// It is that of the way back.
    Inverted,
    /// The cosine of a surface that is seen from behind counts as zero.
    Saturated,
    /// The direction after the reconnection vertex counts as if it had the same density whatever came before.
    FirstOnly,
    /// Densities are those of all lobes together.
    AllLobes,
    /// The density of a light's points counts, and not the area over which its coordinates spread them.
    NoExtent,
    /// The density of a replayed vertex counts.
    ReplayCounted,
}

/// A light as the table of a frame has it.
#[derive(Clone, Copy, Debug)]
struct Listed {
    /// The interval of the numbers that choose it: its begin and its length.
    interval: [f64; 2],
    /// The corners of a triangle.
    triangle: [DVec3; 3],
}

impl Listed {
    fn random(random: &mut SplitMix) -> Self {
        let mut corner = || DVec3::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(1.0, 2.0));
        let triangle = [corner(), corner(), corner()];
        let interval = [random.range(0.0, 0.4), random.range(0.1, 0.5)];
        Self { interval, triangle }
    }

    fn across(&self) -> DVec3 {
        let [a, b, c] = self.triangle;
        (b - a).cross(c - a)
    }

    /// The density of light sampling at its points, and how much its coordinates spread there: per area of a triangle, per steradian of a
    /// cell of the environment from latitude 0.3 to 0.4, without either of a point.
    fn density(&self, case: Case) -> [f64; 2] {
        let probability = self.interval[1];
        let solid_angle = 0.2 * (0.4_f64.sin() - 0.3_f64.sin());
        match case {
            Case::Light => [probability / (0.5 * self.across().length()), self.across().length()],
            Case::Cell => [probability / solid_angle, solid_angle],
            _ => [probability, 1.0],
        }
    }

    /// The point that numbers give.
    fn point(&self, [_, s, t]: [f64; 3]) -> DVec3 {
        let [a, b, c] = self.triangle;
        let root = s.sqrt();
        a * (1.0 - root) + b * (root * (1.0 - t)) + c * (root * t)
    }

    /// The numbers of the point whose barycentric coordinates are those of `point` on `other`.
    fn numbers(&self, other: &Self, point: DVec3, chosen: f64) -> [f64; 3] {
        let [a, b, c] = other.triangle;
        let across = other.across();
        let part = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(across) / across.length_squared();
        let [of_b, of_c] = [part(c, a), part(a, b)];
        let root = of_b + of_c;
        let kept = (chosen - other.interval[0]) / other.interval[1];
        [self.interval[0] + self.interval[1] * kept, root * root, of_c / root]
    }
}

/// Two starts, the plane of a reconnection vertex and that of its successor, at random, with lobes and random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Configuration {
    /// What lies where.
    pub case: Case,
    starts: [Seen; 2],
    joint: Corner,
    next: Corner,
    lobes: [u32; 2],
    /// Two numbers for each direction; of a sampled light the one that chooses it, and two for its point.
    numbers: [f64; 4],
    /// A light in the frame of either start.
    lights: [Listed; 2],
    /// The smallest cosine under which anything leaves or meets a surface.
    least_cos: f64,
}

/// A path from one of the starts, from the vertex on that is joined.
struct Way {
    at: Seen,
    /// The lobe by which it leaves that vertex.
    lobe: u32,
    /// The density with which random replay reached that vertex; 1 if that is the start.
    replayed: f64,
    leg: Leg,
    joint: Corner,
    /// The vertex there and the segment that leaves it.
    beyond: Option<(Seen, Leg, Corner)>,
}

/// Of the differences; their error is its fourth power, times how fast densities bend.
const STEP: f64 = 1.0e-5;

impl Configuration {
    /// That of a number; none if one of the paths does not exist, or leaves or meets a surface under a cosine below `least_cos`.
    pub fn random(index: u64, least_cos: f64) -> Option<Self> {
        let mut random = SplitMix::new(index);
        let case = Case::ALL[random.below(Case::ALL.len())];
        let mut corner = |low: f64, high: f64, tilt: f64| {
            let mut across = || random.range(-1.0, 1.0);
            let position = DVec3::new(across(), across(), 0.0);
            let normal = DVec3::new(tilt * across(), tilt * across(), 1.0).normalize();
            let flipped = if across() < 0.0 { -normal } else { normal };
            let material = materials()[random.below(materials().len())];
            let position = position + DVec3::Z * random.range(low, high);
            Corner { position, normal: flipped, shading: flipped, material, offset: 0.0 }
        };
        let [x, y] = [corner(-0.3, 0.3, 0.3), corner(-0.3, 0.3, 0.3)];
        // two pixels of one surface
        let y = Corner { normal: y.normal * y.normal.dot(x.normal).signum(), material: x.material, ..y };
        let y = Corner { shading: y.normal, ..y };
        let (joint, next) = (corner(1.0, 3.0, 0.6), corner(-3.0, -1.0, 0.6));
        let mut away = |z: f64| DVec3::new(random.range(-0.8, 0.8), random.range(-0.8, 0.8), z).normalize();
        let starts = [x.seen_along(away(-1.0), least_cos)?, y.seen_along(away(-1.0), least_cos)?];
        let lobes = [random.below(4) as u32, random.below(4) as u32];
        let numbers = std::array::from_fn(|_| random.range(0.02, 0.98));
        let lights = [Listed::random(&mut random), Listed::random(&mut random)];
        let configuration = Self { case, starts, joint, next, lobes, numbers, lights, least_cos };
        // at the middle of a lobe the angle turns too fast for differences
        let is_smooth = |moved: [f64; 4]| {
            let listed = matches!(case, Case::Light | Case::Cell | Case::Point);
            listed || [moved[0], moved[2]].iter().all(|u| (0.02..0.98).contains(u))
        };
        let exists = configuration.moved(numbers).is_some_and(is_smooth)
            && configuration.terms(None).iter().all(|t| *t > 1.0e-6);
        exists.then_some(configuration)
    }

    /// Whether the reconnection vertex is seen from behind, by either.
    pub fn is_behind(&self) -> bool {
        let behind = |way: &Way| way.joint.normal.dot(way.leg.direction) > 0.0;
        self.has_joint() && self.ways(self.numbers).is_some_and(|ways| ways.iter().any(behind))
    }

    /// Whether a path is joined to a surface.
    fn has_joint(&self) -> bool {
        matches!(self.case, Case::Drawn | Case::Found | Case::Kept | Case::Replayed)
    }

    /// Whether anything leaves or meets a surface under a smaller cosine than in plain ones.
    pub fn is_grazing(&self) -> bool {
        let least = |way: &Way| {
            let beyond = way
                .beyond
                .map_or(1.0, |(seen, leg, next)| seen.cos(leg.direction).min(next.normal.dot(leg.direction).abs()));
            way.at.cos(way.leg.direction).min(way.joint.normal.dot(way.leg.direction).abs()).min(beyond)
        };
        self.has_joint() && self.ways(self.numbers).is_some_and(|ways| ways.iter().any(|way| least(way) < PLAIN))
    }

    /// The path of those numbers from the first start, and what it is from the second one; none where only numbers are kept.
    fn ways(&self, [a, b, c, d]: [f64; 4]) -> Option<[Way; 2]> {
        let [x, y] = self.starts;
        let least = self.least_cos;
        let direction = x.direction(self.lobes[0], [a, b], least)?;
        if self.case == Case::Environment {
            let leg = Leg { direction, distance: 1.0 };
            let way = |at| Way { at, lobe: self.lobes[0], replayed: 1.0, leg, joint: self.joint, beyond: None };
            return Some([x, y].map(way));
        }
        let joint = self.joint.at(x.corner.position, direction)?;
        let leg = Leg::new(&x, joint.position);
        if self.case == Case::Replayed {
            return self.replayed_ways([a, b], [c, d]);
        }
        let other = Leg::new(&y, joint.position);
        let kept = [(x, leg), (y, other)];
        let kept = kept.map(|(at, leg)| Way { at, lobe: self.lobes[0], replayed: 1.0, leg, joint, beyond: None });
        if self.case == Case::Kept {
            return Some(kept);
        }
        let seen = joint.seen_along(leg.direction, least)?;
        let direction = seen.direction(self.lobes[1], [c, d], least)?;
        let next = self.next.at(joint.position, direction)?;
        let beyond = |way: Way| {
            let seen = joint.seen_along(way.leg.direction, least)?;
            Some(Way { beyond: Some((seen, Leg::new(&seen, next.position), next)), ..way })
        };
        let [first, second] = kept;
        Some([beyond(first)?, beyond(second)?])
    }

    /// The ways from the vertices that the first numbers lead to, to the one that the second numbers give from the first of these.
    fn replayed_ways(&self, first: [f64; 2], second: [f64; 2]) -> Option<[Way; 2]> {
        let least = self.least_cos;
        let replay = |start: &Seen| {
            let direction = start.direction(self.lobes[0], first, least)?;
            let vertex = self.joint.at(start.corner.position, direction)?;
            Some((vertex.seen_along(direction, least)?, start.pdf(self.lobes[0], direction)))
        };
        let [x, y] = [replay(&self.starts[0])?, replay(&self.starts[1])?];
        let direction = x.0.direction(self.lobes[1], second, least)?;
        let joint = self.next.at(x.0.corner.position, direction)?;
        let way = |(at, replayed): (Seen, f64)| {
            let leg = Leg::new(&at, joint.position);
            let leaves = at.cos(leg.direction).min(joint.normal.dot(leg.direction).abs());
            (leaves > least).then_some(Way { at, lobe: self.lobes[1], replayed, leg, joint, beyond: None })
        };
        Some([way(x)?, way(y)?])
    }

    /// The random numbers of the path from the second start, without those that choose lobes.
    fn moved(&self, numbers: [f64; 4]) -> Option<[f64; 4]> {
        let [a, b, c, d] = numbers;
        match self.case {
            Case::Numbers => return Some(numbers),
            Case::Light | Case::Cell | Case::Point => {
                let [x, y] = &self.lights;
                // of a cell and of a point the coordinates are those that were kept
                let same = Listed { triangle: x.triangle, ..*y };
                let to = if self.case == Case::Light { y } else { &same };
                let chosen = x.interval[0] + x.interval[1] * a;
                let [a, b, c] = to.numbers(x, x.point([chosen, b, c]), chosen);
                // over the length of the first interval, so that the step is one of the number that chooses
                return Some([a / x.interval[1], b, c, d]);
            }
            _ => {}
        }
        let [_, way] = self.ways(numbers)?;
        let [e, f] = way.at.coordinates(way.lobe, way.leg.direction);
        if self.case == Case::Replayed {
            return Some([a, b, e, f]);
        }
        let [c, d] = way.beyond.map_or([c, d], |(seen, leg, _)| seen.coordinates(self.lobes[1], leg.direction));
        Some([e, f, c, d])
    }

    /// The terms of the densities of the path from both starts, right or wrong.
    fn terms(&self, wrong: Option<Wrong>) -> [f64; 2] {
        match self.case {
            Case::Numbers => return [1.0; 2],
            Case::Light | Case::Cell | Case::Point => {
                return self.lights.map(|light| {
                    let [density, extent] = light.density(self.case);
                    density * if wrong == Some(Wrong::NoExtent) { 1.0 } else { extent }
                });
            }
            _ => {}
        }
        let Some(ways) = self.ways(self.numbers) else { return [0.0; 2] };
        ways.map(|way| {
            let pdf = |at: &Seen, lobe: u32, direction| {
                if wrong == Some(Wrong::AllLobes) { at.pdf_of_all(direction) } else { at.pdf(lobe, direction) }
            };
            let area = |leg: &Leg, normal: DVec3| {
                let behind = normal.dot(leg.direction) > 0.0;
                if wrong == Some(Wrong::Saturated) && behind { 0.0 } else { leg.per_area(normal) }
            };
            let replayed = if wrong == Some(Wrong::ReplayCounted) { way.replayed } else { 1.0 };
            let first = replayed * pdf(&way.at, way.lobe, way.leg.direction);
            if self.case == Case::Environment {
                return first;
            }
            let first = first * area(&way.leg, way.joint.normal);
            let Some((seen, leg, next)) = way.beyond.filter(|_| wrong != Some(Wrong::FirstOnly)) else { return first };
            let second = pdf(&seen, self.lobes[1], leg.direction);
            first * second * if self.case == Case::Found { area(&leg, next.normal) } else { 1.0 }
        })
    }

    /// The Jacobian by the formula.
    pub fn jacobian(&self, wrong: Option<Wrong>) -> f64 {
        let [x, y] = self.terms(wrong);
        match wrong {
            Some(Wrong::LeftOut) => 1.0,
            Some(Wrong::Inverted) => x / y,
            _ => y / x,
        }
    }

    /// The Jacobian by differences of the numbers of directions, times what the intervals of the lobes' numbers stretch by, and how far it
    /// may be off: by what it changes if the step is twice as long, of which a fifteenth is left. The numbers of directions do not depend on
    /// those of lobes, so the matrix is one of blocks.
    pub fn differences(&self) -> Option<(f64, f64)> {
        let stretched = match self.case {
            Case::Numbers | Case::Light | Case::Cell | Case::Point => 1.0,
            _ => {
                let [first, second] = self.ways(self.numbers)?.map(|way| {
                    let chance = |at: &Seen, lobe: u32, direction| at.chance(lobe, at.local(direction));
                    let beyond = way.beyond.map_or(1.0, |(seen, leg, _)| chance(&seen, self.lobes[1], leg.direction));
                    chance(&way.at, way.lobe, way.leg.direction) * beyond
                });
                second / first
            }
        };
        let [fine, coarse] = [self.determinant(STEP)?, self.determinant(2.0 * STEP)?];
        Some((fine * stretched, (coarse - fine).abs() * stretched))
    }

    /// The determinant of the numbers' derivatives, by differences of fourth order.
    fn determinant(&self, step: f64) -> Option<f64> {
        let mut columns = [[0.0; 4]; 4];
        for (i, column) in columns.iter_mut().enumerate() {
            let at = |step: f64| {
                let mut numbers = self.numbers;
                numbers[i] += step;
                self.moved(numbers)
            };
            let [[a, b], [c, d]] = [[at(step)?, at(-step)?], [at(2.0 * step)?, at(-2.0 * step)?]];
            // the second number of a direction is an angle in turns
            let way = |from: f64, to: f64| (to - from) - (to - from).round();
            *column = std::array::from_fn(|k| (8.0 * way(b[k], a[k]) - way(d[k], c[k])) / (12.0 * step));
        }
        Some(determinant(columns).abs())
    }
}

fn determinant(m: [[f64; 4]; 4]) -> f64 {
    glam::DMat4::from_cols_array_2d(&m).determinant()
}

fn materials() -> [Material; 5] {
    let color = glam::Vec3::new(0.8, 0.5, 0.3);
    let plastic = Material { ior: 1.5, roughness: 0.35, ..Material::diffuse(color) };
    [
        Material::diffuse(color),
        plastic,
        Material { metallic: 1.0, roughness: 0.45, ..Material::diffuse(color) },
        Material { diffuse_transmission: 0.4, diffuse_transmission_color: color, ..plastic },
        Material { ior: 1.4, transmission: 1.0, roughness: 0.5, ..Material::diffuse(color) },
    ]
}

/// What spherical caps make of two numbers (Dupuy and Benyoub 2023; Eto and Tokuyoshi 2023), and back.
impl Shadow {
    fn cap(&self) -> (DVec3, f64) {
        let alpha = self.alpha();
        let wo = self.viewer();
        (DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize(), self.bound())
    }

    /// The direction into which a facet reflects, of those that the bounded cap has.
    pub fn reflected(&self, [a, b]: [f64; 2]) -> DVec3 {
        let (w, k) = self.cap();
        let down = a * (1.0 + k * w.z);
        let (sin, cos) = (TAU * b).sin_cos();
        let r = (down * (2.0 - down)).max(0.0).sqrt();
        let half = DVec3::new(r * cos, r * sin, 1.0 - down) + w;
        let h = DVec3::new(self.alpha() * half.x, self.alpha() * half.y, half.z).normalize();
        h * (2.0 * self.viewer().dot(h)) - self.viewer()
    }

    /// The numbers of which [`Self::reflected`] makes the direction.
    pub fn coordinates_of_reflected(&self, wi: DVec3) -> [f64; 2] {
        let (w, k) = self.cap();
        let h = (wi + self.viewer()).normalize();
        let n = DVec3::new(h.x, h.y, self.alpha() * h.z).normalize();
        let c = n * (2.0 * n.dot(w)) - w;
        [(1.0 - c.z) / (1.0 + k * w.z), (c.y.atan2(c.x) / TAU).rem_euclid(1.0)]
    }
}
