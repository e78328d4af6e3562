//! Presampled candidates of ReSTIR DI.

use restir_shared::technique::restir_di::{self, TileParams, TileWords};

kernel! {
    /// The candidates of all tiles.
    pub fn di_tiles(64, 1) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: TileParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        rays crate::Rays::None,
        read {},
        own { 4: tiles: TileWords },
    }
    |index, tile, at, p, scene| tiles[at] = restir_di::presample(&scene, &p.specialised(settings), index, tile)
}
