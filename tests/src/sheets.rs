//! A wall lit past blended sheets, by lights some of which are blended and masked themselves; and its light by integration in
//! `f64` that shares no code with the kernels.

use crate::panes::{EYE, PANES, Panes, Rectangle, SEEN, WALL, add_pane, before_wall, board, wall};
use crate::random::SplitMix;
use crate::scenes::matte;
use crate::stats::{Moments, TileGrid};
use glam::DVec3;
use restir_host::scene::{AlphaMode, Filter, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, Wrap};
use std::f64::consts::PI;

/// A black sheet: the factor on its alpha, and the codes of its texture, which is not filtered.
struct Sheet {
    rectangle: Rectangle,
    factor: f32,
    codes: &'static [[u8; 2]; 2],
}

const PLAIN: [[u8; 2]; 2] = [[255; 2]; 2];

/// The first lies between a part of the wall and the eye; the others overlap, and the last is tilted.
const SHEETS: [Sheet; 3] = [
    Sheet {
        rectangle: Rectangle { corner: [0.1, -1.3, 0.1], sides: [[1.2, 0.0, 0.0], [0.0, 1.7, 0.0]] },
        factor: 0.4,
        codes: &PLAIN,
    },
    Sheet {
        rectangle: Rectangle { corner: [-1.5, -1.5, 0.38], sides: [[1.7, 0.0, 0.0], [0.0, 3.0, 0.0]] },
        factor: 0.9,
        codes: &[[255, 51], [0, 153]],
    },
    Sheet {
        rectangle: Rectangle { corner: [-0.3, -1.5, 0.55], sides: [[1.8, 0.0, 0.2], [0.0, 1.3, 0.0]] },
        factor: 0.7,
        codes: &PLAIN,
    },
];

/// Half the side of a light with a surface, so large that scattering finds lights as often as sampling does.
const HALF: f64 = 0.55;
const LIGHT_HEIGHT: f64 = 1.6;
const CHECKER: [[u8; 2]; 2] = [[255, 0], [0, 255]];

/// A light with a surface, facing the wall: its middle, what it emits, and its alpha.
struct Panel {
    middle: [f64; 2],
    emission: [f32; 3],
    mode: AlphaMode,
    factor: f32,
    codes: &'static [[u8; 2]; 2],
}

/// One is everywhere, one blended, one masked, and the last is blended here and more so there.
const PANELS: [Panel; 4] = [
    Panel { middle: [-0.6, -0.6], emission: [2.0, 1.2, 0.8], mode: AlphaMode::Opaque, factor: 1.0, codes: &PLAIN },
    Panel { middle: [0.6, -0.6], emission: [2.4, 4.0, 2.4], mode: AlphaMode::Blend, factor: 0.5, codes: &PLAIN },
    Panel {
        middle: [0.6, 0.6],
        emission: [1.6, 1.6, 4.0],
        mode: AlphaMode::Mask { cutoff: 0.3 },
        factor: 0.5,
        codes: &CHECKER,
    },
    Panel {
        middle: [-0.6, 0.6],
        emission: [3.0, 3.0, 1.0],
        mode: AlphaMode::Blend,
        factor: 1.0,
        codes: &[[204, 51], [102, 255]],
    },
];
const LAMP: ([f64; 3], [f32; 3]) = ([0.1, -0.2, 1.4], [1.6, 1.2, 1.8]);

/// The camera stands before the wall, behind the first sheet.
#[derive(Clone, Copy, Debug)]
pub struct Sheets {
    /// There is a pane of clear glass among the sheets as well.
    pub glass: bool,
}

impl Sheets {
    /// As a user would write it.
    pub fn scene(self) -> Scene {
        let mut scene = before_wall(vec![wall(), board()], vec![matte([WALL; 3]), matte([0.0; 3])]);
        for Sheet { rectangle, factor, codes } in &SHEETS {
            add(&mut scene, *rectangle, matte([0.0; 3]), AlphaMode::Blend, *factor, codes);
        }
        for panel in &PANELS {
            let material = Material::emitter("", [0.0; 3], panel.emission);
            add(&mut scene, panel.rectangle(), material, panel.mode, panel.factor, panel.codes);
        }
        let (position, intensity) = LAMP;
        let kind = LightKind::Point { position: position.into() };
        scene.lights = vec![Light { name: "lamp".to_owned(), intensity, kind }];
        if self.glass {
            add_pane(&mut scene, &PANES[0]);
        }
        scene
    }

    /// The share of light that passes all sheets, the glass and the board, by channel.
    fn transmittance(self, from: DVec3, to: DVec3) -> [f64; 3] {
        let passed = |sheet: &Sheet| {
            let place = sheet.rectangle.place(from, to);
            place.map_or(1.0, |place| 1.0 - alpha(sheet.factor, sheet.codes, place))
        };
        let through: f64 = SHEETS.iter().map(passed).product();
        let glass = Panes { coloured: true, count: usize::from(self.glass) };
        glass.transmittance(from, to).map(|glass| glass * through)
    }

    /// Moments of what the camera sees over images of one random point on each light with a surface, and the lamp, a pixel. A
    /// pixel is its middle.
    pub fn reference(self, grid: TileGrid, images: u32) -> Vec<Moments> {
        let area = (2.0 * HALF).powi(2);
        grid.moments(images, |image, x, y| {
            let mut random = SplitMix::new(u64::from((image * grid.height + y) * grid.width + x));
            let place = |index: u32, size: u32| SEEN * (2.0 * (f64::from(index) + 0.5) / f64::from(size) - 1.0);
            let wall = DVec3::new(place(x, grid.width), -place(y, grid.height), 0.0);
            let arriving = |to: DVec3, intensity: [f32; 3]| {
                let way = to - wall;
                let factor = way.normalize().z / way.length_squared();
                DVec3::from(self.transmittance(wall, to)) * DVec3::from(intensity.map(f64::from)) * factor
            };
            let from_lamp = arriving(LAMP.0.into(), LAMP.1);
            let from_panels = PANELS.iter().map(|panel| {
                let at = [random.unit(), random.unit()];
                let point = panel.rectangle().point(at);
                // it is parallel to the wall
                let cos = (point - wall).normalize().z;
                arriving(point, panel.emission) * cos * area * panel.coverage(at)
            });
            let seen = DVec3::from(self.transmittance(wall, DVec3::new(0.0, 0.0, f64::from(EYE))));
            (seen * f64::from(WALL) / PI * (from_lamp + from_panels.sum::<DVec3>())).to_array()
        })
    }
}

fn add(
    scene: &mut Scene,
    Rectangle { corner, sides }: Rectangle,
    material: Material,
    alpha_mode: AlphaMode,
    alpha: f32,
    codes: &[[u8; 2]; 2],
) {
    scene.textures.push(Texture {
        name: "alpha".to_owned(),
        size: [2, 2],
        texels: codes.as_flattened().iter().map(|&code| [255, 255, 255, code]).collect(),
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    });
    let base_color_texture = Some(TextureUse::new(scene.textures.len() - 1));
    let material = scene.add_material(Material { alpha_mode, alpha, base_color_texture, ..material });
    scene.add_mesh("", material, Mesh::quad(corner.into(), sides.map(DVec3::from)));
}

/// The alpha of a texture at a point of the unit square, times the factor.
fn alpha(factor: f32, codes: &[[u8; 2]; 2], [u, v]: [f64; 2]) -> f64 {
    let [column, row] = [u, v].map(|x| usize::from(x >= 0.5));
    f64::from(factor) * f64::from(codes[row][column]) / 255.0
}

impl Panel {
    /// It faces the wall.
    fn rectangle(&self) -> Rectangle {
        let [x, y] = self.middle;
        let corner = [x - HALF, y - HALF, LIGHT_HEIGHT];
        Rectangle { corner, sides: [[0.0, 2.0 * HALF, 0.0], [2.0 * HALF, 0.0, 0.0]] }
    }

    /// How much of it is there at a point of the unit square.
    fn coverage(&self, at: [f64; 2]) -> f64 {
        let alpha = alpha(self.factor, self.codes, at);
        match self.mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => f64::from(u8::from(alpha >= f64::from(cutoff))),
            AlphaMode::Blend => alpha,
        }
    }
}
