//! What the trials vary: confidence and where visibility counts.

use super::table::{PIXELS, produces, target, visible};

/// Where visibility counts (the final shading always traces).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switches {
    /// Z: the contribution weight of an occluded initial sample is zero.
    pub zero: bool,
    /// Q: in the target by which samples are selected.
    pub select: bool,
    /// D: in the targets of the MIS weights.
    pub mis: bool,
}

/// A column of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Candidates of each pixel, which are its confidence too; pixel 0 is canonical.
    pub confidence: [u32; PIXELS],
    /// Where visibility counts.
    pub switches: Switches,
}

/// The same confidence everywhere.
pub const EQUAL: [u32; PIXELS] = [4; PIXELS];
/// Different confidence.
pub const UNEQUAL: [u32; PIXELS] = [4, 8, 2, 16, 1];

const REUSE: Switches = Switches { zero: true, select: false, mis: true };
const NONE: Switches = Switches { zero: false, select: false, mis: false };
const TARGET: Switches = Switches { zero: true, select: true, mis: true };
const DARK: Switches = Switches { zero: true, select: false, mis: false };

impl Setting {
    /// All of them: with visibility reuse, without, with visibility in the target, and with reuse that the MIS weights do
    /// not know of, each with equal and with unequal confidence.
    pub const ALL: [Self; 8] = [
        Self { confidence: EQUAL, switches: REUSE },
        Self { confidence: UNEQUAL, switches: REUSE },
        Self { confidence: EQUAL, switches: NONE },
        Self { confidence: UNEQUAL, switches: NONE },
        Self { confidence: EQUAL, switches: TARGET },
        Self { confidence: UNEQUAL, switches: TARGET },
        Self { confidence: EQUAL, switches: DARK },
        Self { confidence: UNEQUAL, switches: DARK },
    ];

    /// Those whose figures are published for another table of the kind.
    pub const PUBLISHED: [Self; 3] = [Self::ALL[0], Self::ALL[1], Self::ALL[2]];

    /// What tables call it.
    pub fn name(&self) -> String {
        let switches = match self.switches {
            REUSE => "Z, D: visibility reuse",
            NONE => "no visibility reuse",
            TARGET => "Z, Q, D: visibility in the target",
            _ => "Z only: reuse that MIS does not know of",
        };
        let confidence = if self.confidence == EQUAL { "equal M = 4" } else { "M = 4, 8, 2, 16, 1" };
        format!("{switches}; {confidence}")
    }

    /// The target by which a pixel selects.
    pub fn target(&self, pixel: usize, light: usize) -> f64 {
        if self.switches.select & !visible(pixel, light) { 0.0 } else { target(pixel, light) }
    }

    /// a_pixel(light): the target that the MIS weights are told.
    pub fn mis_target(&self, pixel: usize, light: usize) -> f64 {
        if self.switches.mis & !visible(pixel, light) { 0.0 } else { target(pixel, light) }
    }

    /// Whether a pixel's reservoir can hold the light with a contribution weight above zero.
    pub fn can_hold(&self, pixel: usize, light: usize) -> bool {
        produces(pixel, light) & (visible(pixel, light) | !(self.switches.zero | self.switches.select))
    }
}
