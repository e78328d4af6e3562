//! What a pixel is the mean of.

crate::choices! {
    /// How the samples of a pixel are distributed, if they are spread.
    pub enum PixelFilter {
        /// Uniformly over the pixel.
        "box" => Box,
        /// About the pixel by a Blackman-Harris window 3 pixels wide, as Cycles has it by default: edges are smoother. No sample has a
        /// weight, and the noise of neighbours stays independent.
        "blackman-harris" => BlackmanHarris,
    }
}
