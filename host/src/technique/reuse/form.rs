//! Forms of MIS of techniques whose pixels share in mutual pairs.

use restir_shared::resample::mis::Mis;

crate::choices! {
    /// How the samples of a pixel and of its neighbours share what both can find.
    pub enum Form {
        /// A pixel shares with each neighbour.
        "pairwise" => Pairwise,
        /// The same, with a part that the pixel's own sample has for itself.
        "pairwise-defensive" => Defensive,
        /// The same, with as large a part for every neighbour, whatever its confidence (Lin et al. 2022).
        "pairwise-counted-defensive" => Counted,
    }
}

impl Form {
    pub(crate) fn mis(self) -> Mis {
        match self {
            Self::Pairwise => Mis::PAIRWISE,
            Self::Defensive => Mis::PAIRWISE_DEFENSIVE,
            Self::Counted => Mis::PAIRWISE_COUNTED_DEFENSIVE,
        }
    }
}
