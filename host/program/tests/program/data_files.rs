//! Files that other programs made.

use std::path::{Path, PathBuf};

use restir::{buffers::SceneBuffers, image::read_exr, scene::Scene};

/// A file of the folder `assets`.
fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name)
}

#[test]
fn meshes_have_all_their_triangles() {
    for (name, triangles) in [("bunny", 5_648), ("suzanne", 14_842), ("dragon_res3", 47_794), ("dragon_res2", 202_520)]
    {
        let path = asset(&format!("{name}.glb"));
        let scene = Scene::load(path.to_str().unwrap()).unwrap();
        let stats = SceneBuffers::build(&scene).unwrap().stats();
        assert_eq!(stats.triangles + stats.skipped_triangles, triangles, "{name}");
        let in_bounds = |[lo, hi]: [[f32; 3]; 2]| lo.iter().zip(hi).all(|(&lo, hi)| lo < hi && lo > -10.0 && hi < 10.0);
        assert!(in_bounds(scene.bounds()), "{name}: {:?}", scene.bounds());
    }
}

#[test]
fn environment_maps_of_half_floats_are_read() {
    for name in ["studio", "venice", "night"] {
        let image = read_exr(&asset(&format!("{name}.exr"))).unwrap();
        assert_eq!((image.width, image.height), (512, 256));
        assert!(image.pixels.as_flattened().iter().all(|x| x.is_finite()));
        assert!(image.pixels.as_flattened().iter().any(|&x| x > 0.1), "{name}");
    }
}
