//! How many targets the forms ask for, and how many shadow rays that takes where no sample is tested at its own pixel.

use super::support::MIS;
use restir_shared::resample::mis::{INPUTS, Mis};

pub(crate) fn targets_and_rays_are_as_many_as_stated() {
    for k in 2..=INPUTS as u32 {
        for mis in MIS {
            let pairs = (0..k).flat_map(|j| (0..k).map(move |i| (j, i))).filter(|&(j, i)| mis.asks_for(j, i));
            let (own, others): (Vec<_>, Vec<_>) = pairs.partition(|(j, i)| j == i);
            let selected = if mis.asks_for_selected() { k } else { 0 };
            let targets = own.len() as u32 + others.len() as u32 + selected;
            let rays = others.len() as u32 + selected.saturating_sub(1);
            let wanted = match mis {
                Mis::ONE_OVER_M | Mis::CONSTANT => (0, 0),
                Mis::ONE_OVER_Z | Mis::CONTRIBUTION => (k, k - 1),
                Mis::TALBOT => (k * k, k * k - k),
                _ => (2 * (k - 1) + k, 2 * (k - 1)),
            };
            assert!((targets, rays) == wanted, "{mis:?} of {k}: {targets} targets, {rays} rays");
        }
    }
}
