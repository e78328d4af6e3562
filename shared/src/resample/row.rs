use restir_shared::resample::domain::{Pixels, Reservoirs};
use restir_shared::resample::packed::Stored;
use restir_shared::resample::reproject::{Grid, Place};
use restir_shared::resample::similar::GBufferSurface;

/// A row of pixels on a plane, each with a reservoir of its own.
#[derive(Debug)]
pub struct Row<'a>(pub &'a [Stored<f32>]);

impl Reservoirs for Row<'_> {
    type Domain = Line;
    type Packed = Stored<f32>;
    const NO_SAMPLE: f32 = 0.0;
    const NO_RESERVOIR: Stored<f32> =
        Stored { sample: 0.0, contribution_weight: 0.0, confidence: 0.0, visibility: Vec3::ZERO };

    fn domain(&self) -> &Line {
        &Line
    }
    fn unpack(&self, packed: Stored<f32>) -> Stored<f32> {
        packed
    }
    fn pack(&self, stored: &Stored<f32>) -> Stored<f32> {
        *stored
    }
    fn receiver(&self, pixel: Source) -> f32 {
        pixel.pixel as f32 + 1.0
    }
}

impl Pixels for Row<'_> {
    fn grid(&self) -> Grid {
        Grid { width: self.0.len() as u32, height: 1 }
    }
    fn other(&self, pixel: u32) -> Stored<f32> {
        self.0[pixel as usize]
    }
    fn own_surface(&self) -> GBufferSurface {
        self.surface([0, 0])
    }
    fn sees(&self, _at: [u32; 2]) -> bool {
        true
    }
    fn surface(&self, [x, _]: [u32; 2]) -> GBufferSurface {
        GBufferSurface { position: Vec3::X * x as f32, normal: Vec3::Z, distance: 1.0 }
    }
    fn reproject(&self, _here: &GBufferSurface) -> Place {
        Place { x: 0, y: 0, inside: true }
    }
}
