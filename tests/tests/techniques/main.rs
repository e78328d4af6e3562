//! Techniques: what their frames are, and their means against path tracing and against walks in `f64`.

mod alpha;
mod coincident;
mod denoise;
mod genealogy;
mod hybrid;
mod moving;
mod paths;
mod restir_di;
mod restir_di_glass;
mod restir_di_visibility;
mod restir_pt;
mod restir_pt_direct;
mod restir_pt_genealogy;
mod restir_sss;
mod restir_sss_scales;
mod restir_suffix;
mod shift_twin;
mod shifts;
mod subsurface;

restir_tests::suites! { alpha coincident denoise genealogy hybrid moving paths restir_di restir_di_glass restir_di_visibility restir_pt restir_pt_direct restir_pt_genealogy restir_sss restir_sss_scales restir_suffix shift_twin shifts subsurface }
