//! Presampled candidates of ReSTIR DI.

use restir_shared::technique::di::{TileParams, TileWords};
use restir_shared::technique::di;

kernel! {
    /// The candidates of all tiles.
    pub fn di_tiles(64, 1) {
        constants { 0: features = 0xffff_ffff }
        params 0: TileParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: tiles: TileWords },
    }
    |index, tile, at, p, scene| tiles[at] = di::presample(&scene, &p, index, tile)
}

#[cfg(not(target_arch = "spirv"))]
fn cases(scenes: &dyn crate::CaseScenes) -> Vec<crate::Case> {
    use restir_shared::layout::FEATURES_ALL;
    // emissive triangles, an environment, all kinds of lights, none
    ["many-lights", "statue", "tower", "empty"]
        .into_iter()
        .flat_map(|name| {
            let scene = scenes.scene(if name == "empty" { "cornell" } else { name });
            let mut header = scene.header;
            header.light_count = if name == "empty" { 0 } else { header.light_count };
            let params = TileParams { scene: header, tile_size: 100, tiles: 3, frame: 4, seed: 5 };
            [("general", FEATURES_ALL), ("frozen", scene.features)].map(|(kind, features)| {
                crate::Case::new(format!("{name}, {kind}"), params.tile_size, params.tiles)
                    .freeze(0, features)
                    .with(&[params])
                    .with(&scene.geometry)
                    .with(&scene.attributes)
                    .with(&scene.texels)
                    .output()
            })
        })
        .collect()
}
