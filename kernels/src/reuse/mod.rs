//! Reuse between mutual pairs of pixels, see [`restir_shared::resample::mutual`]: the passes that are the same for all techniques, and
//! macros for those that a technique has of its own kind of record.
//!
//! ```
//! use restir_kernels::restir_pt::{pt_merge, pt_shift};
//! use restir_kernels::reuse::reuse_pair;
//!
//! // who shares with whom, then what becomes of it, then one sample of all
//! let pass = [&reuse_pair::DESC, &pt_shift::DESC, &pt_merge::DESC];
//! assert_eq!(pass.map(|kernel| kernel.bindings.last().unwrap().name), ["requests", "results", "merged"]);
//! ```

kernels! {
    reuse_pair,
    reuse_reproject,
}

/// The kernel that answers requests for shifts of a kind of [`Record`](restir_shared::resample::mutual::Record).
macro_rules! shift_kernel {
    (
        $name:ident of $record:ty, with $params:ty, from $origin:ty, asks $asked:ident
        $(, deferred $deferred:ident(|$p:ident| $most:expr))?
    ) => {
        kernel! {
            /// Answers each request: what its sample is where it is shifted to.
            pub fn $name(8, 8) {
                constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
                params 0: $params,
                asks $asked(features) { 1: geometry, 2: attributes, 3: texels },
                $(deferred $deferred({ let $p = p; $most }) { 8: answers, 9: rays },)?
                read {
                    4: requests: restir_shared::resample::mutual::ShiftRequest,
                    5: origins: $origin,
                    6: reservoirs: $record,
                },
                own { 7: results: restir_shared::resample::mutual::ShiftResult },
            }
            |x, y, at, p, scenes| {
                let request = requests[(y * p.width + x) as usize];
                let p = p.specialised(settings);
                results[at] = restir_shared::resample::mutual::answer(&scenes, &p, request, origins, reservoirs)
            }
        }
    };
}

/// The kernel that merges samples of a kind of [`Record`](restir_shared::resample::mutual::Record).
macro_rules! merge_kernel {
    ($name:ident of $record:ty, with $params:ty) => {
        kernel! {
            /// Selects one sample of each pixel's own and its neighbours', or of its own, which is in place then, and the other frame's.
            pub fn $name(8, 8) {
                constants { 0: settings = 0xffff_ffff }
                params 0: $params,
                read {
                    1: reservoirs: $record,
                    2: requests: restir_shared::resample::mutual::ShiftRequest,
                    3: results: restir_shared::resample::mutual::ShiftResult,
                    4: returned: restir_shared::resample::mutual::ShiftResult,
                },
                own { 5: merged: $record },
            }
            |x, y, at, p| {
                let p = p.specialised(settings);
                let crosses = p.flags.contains(restir_shared::resample::params::Flags::OTHER_FRAME);
                let own = if crosses { merged[at] } else { reservoirs[(y * p.width + x) as usize] };
                let shares =
                    restir_shared::resample::mutual::Shares { records: reservoirs, requests, results, returned };
                merged[at] = restir_shared::resample::mutual::merge(&p, &shares, own, [x, y]).record
            }
        }
    };
}

/// The kernel that shades pixels by a kind of [`Record`](restir_shared::resample::mutual::Record).
macro_rules! shade_kernel {
    ($name:ident of $record:ty, with $params:ty) => {
        kernel! {
            /// The radiance of each pixel by way of its sample.
            pub fn $name(8, 8) {
                constants {}
                params 0: $params,
                read { 1: reservoirs: $record, 2: direct: restir_shared::layout::FilmPixel },
                own { 3: film: restir_shared::layout::FilmPixel },
            }
            |x, y, at, p| {
                let index = (y * p.width + x) as usize;
                film[at] = restir_shared::resample::mutual::shade(&reservoirs[index], direct[index])
            }
        }
    };
}
