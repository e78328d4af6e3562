//! Path tracing: the reference of all others, and so tested against the oracle, and Russian roulette against it.

use super::{Cases, Known, Matrix, NOTHING, Row, row};

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    rows: &[("roulette, jitter, dispatches of 4 samples", "roulette=on,jitter=on,dispatch_samples=4")],
    // the last block of the samples is the case
    cases: Cases {
        rows: &[
            row("1 sample", "cornell", 1, ""),
            Row { size: [17, 11], ..row("a later block", "cornell", 12, "jitter=on") },
            row("independent numbers", "cornell", 2, "jitter=on,sampler=independent"),
            row("roulette", "cornell", 2, "jitter=on,max_depth=32,roulette=on"),
            Row { size: [1, 1], ..row("one pixel", "cornell-mitsuba", 8, "") },
            row("many lights", "furnace", 5, "jitter=on,max_depth=5"),
            row("depth 1", "cornell", 1, "max_depth=1"),
            row("all materials", "glass", 2, "jitter=on,max_depth=12"),
            row("rough metal and plastic", "glossy", 2, "jitter=on"),
            row("coats with textures", "coats", 2, "max_depth=6"),
            row("environment", "tower", 2, "jitter=on,max_depth=6"),
            row("a filter", "cornell", 3, "filter=blackman-harris"),
            row("masks", "masks", 4, "max_depth=6"),
            row("blended", "sheets", 4, "max_depth=6"),
            row("lights in wax, milk", "candles", 2, "max_depth=8,longest_walk=160"),
            row("media with textures", "moving-media", 2, "max_depth=5,longest_walk=130,after_subsurface=direct-light"),
            row("profiles, lights in wax, milk", "candles", 2, "max_depth=8,subsurface=hybrid,lambert_below=0.2"),
            row("profiles of media with textures", "moving-media", 2, "max_depth=5,subsurface=hybrid"),
            row("a profile alone", "slab", 2, "max_depth=3,subsurface=diffusion,support=published,crossings=one"),
            row(
                "signed profiles",
                "slab",
                2,
                "subsurface=hybrid,profile=searchlight,way_out=drawn,radius_channel=albedo,segments=3",
            ),
            row(
                "clamped profiles",
                "candles",
                1,
                "subsurface=hybrid,profile=clamped,parts=subsurface,profile_paths=off,roulette=on",
            ),
            row("profiles without paths", "slab", 1, "subsurface=hybrid,profile_paths=off,counted_twice=on"),
            row("mist, clear borders", "clear-media", 2, "max_depth=6,longest_walk=100"),
            row("a slab", "slab", 2, "max_depth=3,orders=1..3,longest_walk=70,roulette=on"),
        ],
        ..NOTHING.cases
    },
    matrix: Matrix {
        scenes: &[("cornell", ""), ("furnace", ""), ("slab", ""), ("candles", "")],
        goals: &[("candles", 4.0)],
        tile_goal: f64::INFINITY,
        beyond: &[("candles", "lights_inside=off")],
        common: "max_depth=6,jitter=on",
        cells: || ["roulette=off", "roulette=on", "lights_inside=off"].map(str::to_owned).to_vec(),
    },
    ..NOTHING
};
