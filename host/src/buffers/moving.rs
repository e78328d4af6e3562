//! Scenes that move: the same triangles, tree and textures at another time.

use super::{
    Flat, Geometry, SceneBuffers, check, features,
    lights::{LightTables, emits},
    scene_error, surrounded,
    triangles::check_moved,
};
use crate::Error;
use crate::scene::{Camera, Instance, Material, Mesh, Scene, TextureUse};
use restir_shared::layout::{ALIAS_WORDS, ENVIRONMENT_WORDS, FEATURE_LIGHT_TABLE, LIGHT_WORDS, PUNCTUAL_WORDS};
use restir_shared::scene::LightAddress;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Where the objects of a moment are.
#[derive(Clone, Debug, Default)]
pub(super) struct Posed {
    meshes: Vec<Arc<Mesh>>,
    instances: Vec<Instance>,
    /// The triangles that were set apart from others.
    apart: BTreeSet<usize>,
}

impl Posed {
    pub(super) fn new(scene: &Scene, apart: BTreeSet<usize>) -> Arc<Self> {
        Arc::new(Self { meshes: scene.meshes.clone(), instances: scene.instances.clone(), apart })
    }

    /// Of each object, whether it is another mesh in `scene`, or elsewhere.
    fn moved(&self, scene: &Scene) -> Vec<bool> {
        let moved = |(before, now): (&Instance, &Instance)| {
            before.transform != now.transform || !Arc::ptr_eq(&self.meshes[before.mesh], &scene.meshes[now.mesh])
        };
        self.instances.iter().zip(&scene.instances).map(moved).collect()
    }
}

/// What stays while a scene moves.
#[derive(Debug)]
pub(super) struct Moving {
    scene: Scene,
    flat: Flat,
    features: u32,
    most_lights: u32,
}

impl Moving {
    /// Of a scene with its animation.
    pub(super) fn new(scene: &Scene, flat: Flat) -> Self {
        // with every emitter shining
        let tables = LightTables::new(scene, &flat.triangles, flat.environment.as_ref(), &flat.bvh.bounds);
        let (relative, around) = surrounded(scene, &flat.triangles);
        let of_scene = |scene, around: &[u32]| features::of_scene(scene, &flat, &tables, around);
        // what lies in another body may leave it, and powers that are equal at one time may not be at another
        let features = of_scene(&relative, &around) | of_scene(scene, &vec![0; around.len()]) | FEATURE_LIGHT_TABLE;
        // a triangle without an area may get one
        let emitting = flat.triangles.iter().filter(|t| emits(&scene.materials[t.material(scene)])).count();
        let most_lights = (emitting + scene.lights.len() + usize::from(flat.environment.is_some())) as u32;
        Self { scene: scene.clone(), flat, features, most_lights }
    }
}

impl SceneBuffers {
    /// As a moment of a scene that moves, with all the features that it has at any time.
    pub(super) fn with_motion(mut self, moving: Arc<Moving>) -> Self {
        self.features = moving.features;
        self.stats.features = features::names(self.features);
        self.moving = Some(moving);
        self
    }

    /// Whether the scene has an animation: this is one moment of it.
    pub fn is_animated(&self) -> bool {
        self.moving.is_some()
    }

    /// The scene at a frame; itself if nothing ever changes. Triangles keep their ids, feature bits are those of all times,
    /// and the lights that shine keep their order. A triangle without an area is not seen.
    ///
    /// # Errors
    /// [`Error::Scene`] if it moves too far away.
    pub fn at(&self, frame: f64) -> Result<Self, Error> {
        match &self.moving {
            Some(moving) => {
                let scene = moving.scene.at(frame);
                check::check_lights(&scene)?;
                let differs =
                    |what| scene_error(&scene, format!("has by animation other {what} than at first; correct it"));
                self.refitted(moving, &scene)?.map_err(differs)
            }
            None => Ok(self.clone()),
        }
    }

    /// The camera at a frame.
    pub fn camera_at(&self, frame: f64) -> Camera {
        self.moving.as_ref().and_then(|moving| moving.scene.camera_at(frame)).unwrap_or(self.camera)
    }

    /// As [`Self::at`], for a scene that an embedder has edited: transforms of instances, positions of vertices, factors
    /// of materials and lights may differ.
    ///
    /// # Errors
    /// As of [`Self::build`]; [`Error::Scene`] as well if anything else differs, or if this was built of a scene that stands still,
    /// of which nothing is kept.
    pub fn refit(&self, scene: &Scene) -> Result<Self, Error> {
        let differs = |what| scene_error(scene, format!("differs in {what}, which cannot be refitted; build it anew"));
        self.follow(scene)?.map_err(differs)
    }

    /// As [`Self::refit`], or what cannot be refitted.
    pub(crate) fn follow(&self, scene: &Scene) -> Result<Result<Self, &'static str>, Error> {
        check::check_edited(scene, self.moving.as_ref().map(|moving| &moving.scene))?;
        match &self.moving {
            None => Ok(Err("that it moves")),
            Some(moving) => match difference(&moving.scene, scene) {
                Some(what) => Ok(Err(what)),
                None => self.refitted(moving, scene),
            },
        }
    }

    fn refitted(&self, moving: &Arc<Moving>, scene: &Scene) -> Result<Result<Self, &'static str>, Error> {
        let flat = &moving.flat;
        let moved = self.posed.moved(scene);
        check_moved(scene, &flat.triangles, &moved)?;
        let geometry = Geometry::Moved { before: &self.geometry, moved: &moved, apart: &self.posed.apart };
        let buffers = Self::assemble(scene, flat, geometry, self.texels.clone())?;
        if buffers.features & !moving.features != 0 || buffers.header.light_count > moving.most_lights {
            return Ok(Err("the kinds of its lights or materials"));
        }
        // without a camera it is seen as it was at first
        let camera = scene.camera.unwrap_or(self.camera);
        Ok(Ok(Self { camera, ..buffers }.with_motion(moving.clone())))
    }

    /// Whether nothing of the scene or its camera differs from another moment of it.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.camera == other.camera
            && self.header == other.header
            && self.attributes == other.attributes
            && self.geometry == other.geometry
    }

    /// What moves, and how, in words; nothing of a scene that stands still.
    pub(crate) fn motion(&self) -> String {
        self.moving.as_ref().map_or_else(String::new, |moving| format!("{:?}", moving.scene.animation))
    }

    /// For each triangle, by the id that hits have, its instance and its index in that instance's mesh: for renderers that bring hits
    /// of their own. The coordinates of a hit are the weights of the triangle's second and third corner, which change places where the
    /// instance's transform mirrors. A lamp that lies in another surface is set apart from it in the arena
    /// ([`SceneStats::coincident_lamps`](super::SceneStats::coincident_lamps)). None of a scene that was built to stand still.
    pub fn triangle_ids(&self) -> Option<Vec<[u32; 2]>> {
        Some(self.moving.as_ref()?.flat.triangles.iter().map(|triangle| triangle.place()).collect())
    }

    /// The most lights that shine at any time.
    pub(crate) fn most_lights(&self) -> u32 {
        self.moving.as_ref().map_or(self.header.light_count, |moving| moving.most_lights)
    }

    /// Whether reservoirs can name each light.
    pub(crate) fn check_addresses(&self) -> Result<(), Error> {
        let (count, limit) = (self.most_lights(), LightAddress::NO_LIGHT - 1);
        if count > limit { Err(Error::TooManyLights { count, limit }) } else { Ok(()) }
    }

    /// The most words of 32 bits that the geometry and the attributes of any time take, these with the lights'
    /// counterparts in both directions.
    pub(crate) fn most_words(&self) -> [usize; 2] {
        let Some(moving) = &self.moving else { return [self.geometry.len(), self.attributes.len()] };
        let lights = moving.most_lights;
        let punctual = moving.scene.lights.len() as u32 * PUNCTUAL_WORDS;
        let tables = lights * (LIGHT_WORDS + ALIAS_WORDS) + punctual + ENVIRONMENT_WORDS;
        let counterparts = 2 * lights.div_ceil(4);
        [self.geometry.len(), 4 * (self.header.light_base + tables + counterparts) as usize]
    }

    /// For each light its index in `other`, the same scene at another time, or [`LightAddress::NO_LIGHT`]; `None` if the
    /// same lights shine. Four to a word of the arena.
    pub(crate) fn counterparts(&self, other: &Self) -> Option<Arc<[u32]>> {
        let (own, others) = (self.light_keys(), other.light_keys());
        let index = |key| others.binary_search(key).map_or(LightAddress::NO_LIGHT, |index| index as u32);
        let mut words: Vec<u32> = own.iter().map(index).collect();
        words.resize(words.len().next_multiple_of(4), LightAddress::NO_LIGHT);
        (own != others).then(|| words.into())
    }

    /// The triangle of a light, or its index among the punctual lights.
    pub(crate) fn light_index(&self, light: u32) -> u32 {
        self.light_keys()[light as usize][1]
    }

    /// What each light is: its kind, and its triangle or index; ascending.
    fn light_keys(&self) -> Vec<[u32; 2]> {
        let (first, count) = (self.header.light_base as usize, self.header.light_count as usize);
        const { assert!(LIGHT_WORDS == 1) };
        self.attributes.chunks_exact(4).skip(first).take(count).map(|record| [record[2], record[0]]).collect()
    }
}

/// What two scenes differ in, if one cannot be refitted to the other.
fn difference(a: &Scene, b: &Scene) -> Option<&'static str> {
    let same_mesh = |(a, b): (&Arc<Mesh>, &Arc<Mesh>)| {
        Arc::ptr_eq(a, b)
            || a.indices == b.indices
                && a.material == b.material
                && a.positions.len() == b.positions.len()
                && a.normals.is_empty() == b.normals.is_empty()
                && (&a.uvs, &a.second_uvs) == (&b.uvs, &b.second_uvs)
                && a.tangents.is_empty() == b.tangents.is_empty()
    };
    let environment = match (&a.environment, &b.environment) {
        // the pixels need not be looked at where they are shared
        (Some(a), Some(b)) => {
            let same_pixels = Arc::ptr_eq(&a.pixels, &b.pixels) || a.pixels == b.pixels;
            same_pixels && (a.size, a.scale, a.rotation) == (b.size, b.scale, b.rotation)
        }
        (a, b) => a.is_none() && b.is_none(),
    };
    let textures = |scene: &Scene| -> Vec<_> {
        let of = |used: Option<&TextureUse>| used.map(|used| (used.texture, used.uv_set));
        let inside = |m: &Material| m.volume.map(|volume| volume.textures().map(of));
        scene.materials.iter().map(|m| (m.textures().map(of), inside(m))).collect()
    };
    let scattering = |scene: &Scene| -> Vec<_> {
        scene.materials.iter().map(|m| m.volume.is_some_and(|volume| volume.scatters())).collect()
    };
    let parts = [
        ("its origin", a.origin == b.origin),
        ("its meshes", a.meshes.len() == b.meshes.len() && a.meshes.iter().zip(&b.meshes).all(same_mesh)),
        ("its instances", a.instances.iter().map(|i| i.mesh).eq(b.instances.iter().map(|i| i.mesh))),
        (
            "the alpha modes of its materials",
            a.materials.iter().map(|m| m.alpha_mode).eq(b.materials.iter().map(|m| m.alpha_mode)),
        ),
        ("which of its materials scatter inside", scattering(a) == scattering(b)),
        ("which of its instances are one object", a.objects() == b.objects()),
        ("its textures", a.textures == b.textures && textures(a) == textures(b)),
        ("the number of its lights", a.lights.len() == b.lights.len()),
        ("its environment", environment),
    ];
    parts.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Interpolation, Material, Property, Track, builtin};
    use glam::DVec3;
    use restir_shared::layout::{LIGHT_PUNCTUAL, LIGHT_TRIANGLE};

    fn moving() -> (Scene, SceneBuffers) {
        let scene = builtin::scene("moving").expect("built in");
        let buffers = SceneBuffers::build(&scene).expect("builds");
        (scene, buffers)
    }

    #[test]
    fn at_the_same_time_the_arenas_are_the_same() {
        let (scene, first) = moving();
        for time in [0.0, 9.0, 14.5] {
            let there = first.at(time).expect("moves");
            let again = there.at(25.0).and_then(|later| later.at(time)).expect("moves");
            let edited = first.refit(&scene.at(time)).expect("refits");
            for other in [&again, &edited] {
                assert_eq!(there.header, other.header);
                assert_eq!(there.geometry, other.geometry);
                assert_eq!(there.attributes, other.attributes);
            }
            assert_eq!(time == 0.0, there.geometry == first.geometry);
            assert_eq!(first.features, there.features);
        }
        assert_eq!(first.at(0.0).expect("moves").attributes, first.attributes);
    }

    /// What did not move is taken over, and the bits are those of a scene that was moved as a whole.
    #[test]
    fn a_refit_does_not_depend_on_the_moment_before() {
        let mut scene = builtin::scene("toys").expect("built in").at(3.0);
        let first = SceneBuffers::build_editable(&scene).expect("builds");
        let mut last = first.clone();
        for (object, step) in [(0, 0.1), (2, -0.3), (0, 0.2), (1, 5.0)] {
            scene.instances[object].transform.translation.y += step;
            if object == 2 {
                Arc::make_mut(&mut scene.meshes[1]).positions[3][0] += 0.5;
            }
            scene.materials[0].base_color = [0.5; 3];
            let moved = last.refit(&scene).expect("refits");
            let mut apart = scene.clone();
            apart.meshes.iter_mut().for_each(|mesh| *mesh = Arc::new(Mesh::clone(mesh)));
            let at_once = first.refit(&apart).expect("refits");
            assert_eq!(moved.geometry, at_once.geometry);
            assert_eq!((moved.header, &moved.attributes), (at_once.header, &at_once.attributes));
            assert_eq!(moved.stats(), at_once.stats());
            last = moved;
        }
    }

    /// What is set apart from another surface is where it was as soon as it does not shine, or the other one goes.
    #[test]
    fn lamps_in_other_surfaces_do_not_depend_on_the_moment_before() {
        let mut scene = Scene { name: "flush".to_owned(), ..Scene::default() };
        let white = scene.add_material(Material::diffuse("white", [0.5; 3]));
        let glowing = scene.add_material(Material::emitter("glowing", [0.5; 3], [2.0; 3]));
        let square =
            |half: f64| Mesh::quad(DVec3::new(-half, 1.0, -half), [DVec3::X * 2.0 * half, DVec3::Z * 2.0 * half]);
        scene.add_mesh("ceiling", white, square(2.0));
        scene.add_mesh("lamp", glowing, square(0.5));
        scene.add_mesh("apart", glowing, Mesh::cuboid(DVec3::ZERO, DVec3::splat(0.2)));
        let first = SceneBuffers::build_editable(&scene).expect("builds");
        assert_eq!(first.stats().coincident_lamps, [["lamp".to_owned(), "ceiling".to_owned()]]);
        let y = |buffers: &SceneBuffers, object: u32| -> Vec<f32> {
            let places = buffers.triangle_ids().expect("editable").into_iter().enumerate();
            let first = |triangle: usize| (buffers.header.triangle_base as usize + 3 * triangle) * 4;
            let of = places.filter(|(_, place)| place[0] == object);
            of.map(|(triangle, _)| f32::from_bits(buffers.geometry[first(triangle) + 1])).collect()
        };
        assert!(y(&first, 0).iter().all(|y| *y == 1.0) && y(&first, 1).iter().all(|y| (0.9999..1.0).contains(y)));
        let mut last = first.clone();
        for (emission, height) in [(0.0, 0.0), (2.0, 0.0), (2.0, 0.3), (0.0, 0.3), (0.0, 0.0), (2.0, 0.0)] {
            scene.materials[glowing].emission = [emission; 3];
            scene.instances[0].transform.translation.y = height;
            last = last.refit(&scene).expect("refits");
            let at_once = first.refit(&scene).expect("refits");
            assert_eq!((&last.geometry, last.header), (&at_once.geometry, at_once.header));
            let moved = emission > 0.0 && height == 0.0;
            assert_eq!(y(&last, 1).iter().all(|y| *y < 1.0), moved, "{emission}, {height}");
            assert_eq!(last.stats().coincident_lamps.len(), usize::from(moved));
        }
    }

    #[test]
    fn no_time_has_more_than_there_is_room_for() {
        let (_, first) = moving();
        for time in 0..32 {
            let [this, next] = [0.0, 1.0].map(|step| first.at(f64::from(time) + step).expect("moves"));
            let [geometry, attributes] = first.most_words();
            let counterparts = [this.counterparts(&next), next.counterparts(&this)];
            let words: usize = counterparts.iter().flatten().map(|words| words.len()).sum();
            assert!(next.geometry.len() == geometry && next.attributes.len() + words <= attributes, "{time}");
        }
    }

    #[test]
    fn what_scatters_inside_cannot_change_in_place() {
        let scene = builtin::scene("candles").expect("built in");
        let buffers = SceneBuffers::build_editable(&scene).expect("builds");
        let mut edited = scene.clone();
        let table = edited.materials.iter_mut().find(|m| m.volume.is_none()).expect("the table is solid");
        table.volume = scene.materials.iter().find_map(|m| m.volume);
        let followed = buffers.follow(&edited).expect("is sound");
        assert_eq!(followed.err(), Some("which of its materials scatter inside"));
    }

    #[test]
    fn lights_find_their_counterparts() {
        let (_, first) = moving();
        let at = |time| first.at(time).expect("moves");
        assert!(at(1.0).counterparts(&at(2.0)).is_none(), "nothing goes out");
        // the sign's two triangles go out at 5, the bulb at 7
        let (before, after) = (at(4.0), at(8.0));
        let forth = before.counterparts(&after).expect("lights go out");
        let back = after.counterparts(&before).expect("lights come back");
        let (before, after) = (before.light_keys(), after.light_keys());
        assert_eq!(before.len(), after.len() + 3);
        for (light, key) in after.iter().enumerate() {
            assert_eq!(before[back[light] as usize], *key);
            assert_eq!(forth[back[light] as usize], light as u32);
        }
        let gone: Vec<u32> =
            (0..before.len()).filter(|&i| forth[i] == LightAddress::NO_LIGHT).map(|i| before[i][0]).collect();
        assert_eq!(gone.len(), 3);
        assert_eq!(before.iter().filter(|key| key[0] == LIGHT_PUNCTUAL).count(), 2);
        assert!(before.windows(2).all(|pair| pair[0] < pair[1]) && before[0][0] == LIGHT_TRIANGLE);
    }

    /// What has no size at first is there, and shines, as soon as it has one.
    #[test]
    fn triangles_lose_their_area_and_get_it_back() {
        let mut scene = builtin::scene("toys").expect("built in");
        let rig = &mut scene.animation.rig;
        let node = rig.nodes.iter().position(|node| node.name == "mast").expect("of the carousel");
        let values = [[0.0; 3], [1.0; 3], [0.0; 3]].as_flattened().to_vec();
        let (property, interpolation, times) = (Property::Scale, Interpolation::Step, vec![0.0, 1.0, 2.0]);
        rig.tracks.push(Track { node, property, interpolation, times, values });
        scene.animation.frame_rate = 1.0;
        let first = SceneBuffers::build(&scene).expect("builds");
        let [hidden, shown, gone] = [0.0, 1.0, 2.0].map(|frame| first.at(frame).expect("moves"));
        assert_eq!(hidden.stats().triangles, shown.stats().triangles);
        assert_eq!([&hidden, &gone].map(|there| there.stats().emissive_triangles), [2; 2]);
        assert_eq!(shown.stats().emissive_triangles, 14);
        assert!(shown.header.light_count <= first.most_lights());
        let fresh = SceneBuffers::build(&scene.at(1.0)).expect("builds");
        assert_eq!((shown.stats().bounds, shown.stats().triangles), (fresh.stats().bounds, fresh.stats().triangles));
        let forth = hidden.counterparts(&shown).expect("lights come");
        assert!(forth.iter().take(2).all(|&light| light != LightAddress::NO_LIGHT));
    }

    #[test]
    fn what_cannot_be_refitted_is_refused() {
        let (scene, first) = moving();
        let refused = |edit: fn(&mut Scene)| {
            let mut scene = scene.at(3.0);
            edit(&mut scene);
            first.refit(&scene).expect_err("refused").to_string()
        };
        type Edit = fn(&mut Scene);
        let wrong: [(Edit, &str); 4] = [
            (|scene| Arc::make_mut(&mut scene.meshes[0]).indices.truncate(1), "meshes"),
            (|scene| scene.instances.push(Instance { ..scene.instances[0] }), "instances"),
            (|scene| scene.lights.clear(), "lights"),
            (|scene| scene.materials[0].emission = [1.0; 3], "kinds of its lights"),
        ];
        for (edit, part) in wrong {
            let message = refused(edit);
            assert!(message.contains(part), "{part}: {message}");
        }
        let still = SceneBuffers::build(&scene.at(0.0)).expect("builds");
        assert!(!still.is_animated() && still.refit(&scene).is_err());
    }
}
