//! Small glTF files with textures, lights and every extension that the importer reads, written independently of the
//! exporter.

use glam::{DVec2, Vec3};
use restir_host::scene::Scene;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::io;
use std::path::{Path, PathBuf};

/// A checkerboard of 8 x 8 texels in 16 x 16, in red and blue.
const JPEG: &[u8] = include_bytes!("../../host/src/scene/gltf/tests/files/checker.jpg");

/// A document and the bytes that it refers to.
pub(crate) struct File {
    pub(crate) document: Value,
    bytes: Vec<u8>,
}

impl File {
    /// A floor and a wall of material 0, under a lamp of material 1, and a camera.
    pub(crate) fn stage(materials: Value) -> Self {
        let mut file = Self { document: json!({ "asset": { "version": "2.0" }, "scene": 0 }), bytes: Vec::new() };
        file.document["materials"] = materials;
        let floor = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
        let wall = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0], [-1.0, 2.0, -1.0]];
        let lamp = [[-0.5, 2.0, -0.5], [0.5, 2.0, -0.5], [0.5, 2.0, 0.5], [-0.5, 2.0, 0.5]];
        // The floor is shaded as if it were domed: its normals lean outwards.
        let domed = floor.map(|[x, _, z]| [0.28 * x, 0.918_259_2, 0.28 * z]);
        file.quad("floor", floor, Some(domed), 3.0, 0);
        file.quad("wall", wall, None, 1.0, 0);
        file.quad("lamp", lamp, None, 1.0, 1);
        file.document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
        file.add("nodes", json!({ "camera": 0, "translation": [0.0, 1.0, 4.0] }));
        file
    }

    /// Adds a member to an array of the document and gives its index.
    pub(crate) fn add(&mut self, array: &str, member: Value) -> usize {
        if self.document[array].is_null() {
            self.document[array] = json!([]);
        }
        let members = self.document[array].as_array_mut().expect("an array of the document");
        members.push(member);
        members.len() - 1
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.add("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// Adds an accessor of so many floats an element, one, two to four, or sixteen.
    pub(crate) fn floats(&mut self, values: &[f32], components: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len() / components;
        let kind = match components {
            1 => "SCALAR".to_owned(),
            16 => "MAT4".to_owned(),
            _ => format!("VEC{components}"),
        };
        self.add("accessors", json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }))
    }

    /// Adds an accessor of the corners of triangles.
    pub(crate) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = indices.len();
        self.add("accessors", json!({ "bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR" }))
    }

    /// Adds a quadrilateral ([`Self::face`]) as a mesh of its own.
    fn quad(
        &mut self,
        name: &str,
        corners: [[f32; 3]; 4],
        normals: Option<[[f32; 3]; 4]>,
        repeats: f32,
        material: usize,
    ) {
        let face = self.face(corners, normals, repeats, material);
        self.body(name, vec![face]);
    }

    /// Adds a mesh, once.
    pub(crate) fn body(&mut self, name: &str, faces: Vec<Value>) {
        let mesh = self.add("meshes", json!({ "name": name, "primitives": faces }));
        self.add("nodes", json!({ "mesh": mesh }));
    }

    /// A quadrilateral whose texture coordinates reach from 0 to `repeats`; with tangents where it has normals.
    fn face(&mut self, corners: [[f32; 3]; 4], normals: Option<[[f32; 3]; 4]>, repeats: f32, material: usize) -> Value {
        let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(|uv| uv.map(|x| repeats * x));
        let positions = self.floats(corners.as_flattened(), 3);
        let bound = |of: fn(Vec3, Vec3) -> Vec3| corners.map(Vec3::from).into_iter().reduce(of).map(|v| v.to_array());
        self.document["accessors"][positions]["min"] = json!(bound(Vec3::min));
        self.document["accessors"][positions]["max"] = json!(bound(Vec3::max));
        let mut attributes = json!({ "POSITION": positions, "TEXCOORD_0": self.floats(uvs.as_flattened(), 2) });
        if let Some(normals) = normals {
            let along = |[x, y, _]: [f32; 3]| DVec2::new(y.into(), -f64::from(x)).normalize().as_vec2();
            let tangents = normals.map(|normal| along(normal).extend(0.0).extend(1.0).to_array());
            attributes["NORMAL"] = json!(self.floats(normals.as_flattened(), 3));
            attributes["TANGENT"] = json!(self.floats(tangents.as_flattened(), 4));
        }
        json!({ "attributes": attributes, "mode": 6, "material": material })
    }

    /// Adds a box of one material, front sides out.
    fn solid(&mut self, name: &str, [lo, hi]: [[f32; 3]; 2], material: usize) {
        let at = |bits: u32| [0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { hi[axis] } else { lo[axis] });
        // corners by their bits, counter-clockwise as seen from outside
        let faces = [[4, 5, 7, 6], [1, 0, 2, 3], [5, 1, 3, 7], [0, 4, 6, 2], [6, 7, 3, 2], [0, 1, 5, 4]];
        let faces = faces.map(|corners| self.face(corners.map(at), None, 1.0, material));
        self.body(name, faces.into());
    }

    /// Adds a texture of an embedded image, with its sampler.
    pub(crate) fn texture(&mut self, image: &[u8], sampler: Value) -> usize {
        let kind = if image.starts_with(b"\x89PNG") { "image/png" } else { "image/jpeg" };
        let view = self.view(image);
        let image = self.add("images", json!({ "bufferView": view, "mimeType": kind }));
        let sampler = self.add("samplers", sampler);
        self.add("textures", json!({ "source": image, "sampler": sampler }))
    }

    /// The document with all of its nodes in one scene.
    fn finished(mut self) -> Self {
        let nodes = self.document["nodes"].as_array().map_or(&[][..], Vec::as_slice);
        let children: Vec<&Value> = nodes.iter().filter_map(|node| node["children"].as_array()).flatten().collect();
        let nodes: Vec<usize> = (0..nodes.len()).filter(|node| !children.contains(&&json!(node))).collect();
        self.document["scenes"] = json!([{ "nodes": nodes }]);
        self.document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        let mut extensions = BTreeSet::new();
        note_extensions(&self.document, &mut extensions);
        if !extensions.is_empty() {
            self.document["extensionsUsed"] = json!(extensions);
        }
        self
    }

    pub(crate) fn glb(self) -> Vec<u8> {
        self.edited_glb(|text| text)
    }

    /// As [`Self::glb`], without saying which extensions are used.
    pub(crate) fn undeclared_glb(self) -> Vec<u8> {
        self.edited_glb(|text| text.replace("extensionsUsed", "extensionsOther"))
    }

    /// As [`Self::glb`], with the text of the document edited.
    pub(crate) fn edited_glb(self, edit: impl FnOnce(String) -> String) -> Vec<u8> {
        let Self { document, bytes } = self.finished();
        let mut text = edit(document.to_string()).into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend((28 + text.len() as u32 + bytes.len() as u32).to_le_bytes());
        for (kind, data) in [(b"JSON", text), (b"BIN\0", bytes)] {
            file.extend((data.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(data);
        }
        file
    }
}

/// A file with the members of an extension renamed, wherever they are: as its author would have written who does not know it.
pub fn without(file: &[u8], extension: &str) -> Vec<u8> {
    // of the same length, so that nothing moves
    let unknown = "X".repeat(extension.len());
    let mut changed = file.to_vec();
    let name = format!("\"{extension}\"");
    let places = file.windows(name.len()).enumerate().filter(|(_, window)| *window == name.as_bytes());
    for (at, _) in places {
        changed[at + 1..at + 1 + unknown.len()].copy_from_slice(unknown.as_bytes());
    }
    changed
}

/// Gathers the names of all extensions under a value.
fn note_extensions(value: &Value, names: &mut BTreeSet<String>) {
    if let Some(extensions) = value.get("extensions").and_then(Value::as_object) {
        names.extend(extensions.keys().cloned());
    }
    match value {
        Value::Array(values) => values.iter().for_each(|value| note_extensions(value, names)),
        Value::Object(members) => members.values().for_each(|value| note_extensions(value, names)),
        _ => {}
    }
}

pub(crate) fn lamp() -> Value {
    json!({ "name": "lamp", "pbrMetallicRoughness": { "metallicFactor": 0.0 }, "emissiveFactor": [1.0, 0.9, 0.8],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 5.0 } } })
}

/// A stage whose subject is of the given material.
fn stage(subject: Value) -> File {
    File::stage(json!([subject, lamp()]))
}

/// A dielectric with the given texture of base colour.
pub(crate) fn painted(info: Value) -> Value {
    json!({ "pbrMetallicRoughness": { "baseColorTexture": info, "metallicFactor": 0.0, "roughnessFactor": 0.8 } })
}

pub(crate) fn png<const CHANNELS: usize>(side: u32, texel: impl Fn(u32, u32) -> [u8; CHANNELS]) -> Vec<u8> {
    let bytes: Vec<u8> = (0..side * side).flat_map(|i| texel(i % side, i / side)).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, side, side);
    encoder.set_color(if CHANNELS == 4 { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&bytes)?;
        writer.finish()
    });
    written.expect("a PNG in memory");
    file
}

/// Four by four texels, each of another colour.
pub(crate) fn colors() -> Vec<u8> {
    png(4, |x, y| if (x + y) % 2 == 0 { [250, 60 * x as u8, 60 * y as u8] } else { [20, 90, 250 - 60 * y as u8] })
}

/// Grey, of sixteen alphas.
pub(crate) fn translucent() -> Vec<u8> {
    png(4, |x, y| [90, 90, 90, (17 * (4 * y + x)) as u8])
}

/// Roughness in green, metalness in blue.
pub(crate) fn metallic_roughness() -> Vec<u8> {
    png(4, |x, y| [0, 40 + 60 * x as u8, if y % 2 == 0 { 255 } else { 0 }])
}

/// A normal map of bumps.
pub(crate) fn bumps() -> Vec<u8> {
    let slope = |i: u32| (f64::from(i) / 8.0 * std::f64::consts::TAU).sin() * 0.4;
    let byte = |x: f64| (127.5 * (x + 1.0)).round() as u8;
    png(8, |x, y| [byte(slope(x)), byte(slope(y)), byte(0.8)])
}

const NEAREST: u32 = 9728;
pub(crate) const LINEAR: u32 = 9729;
const CLAMP: u32 = 33_071;
const MIRROR: u32 = 33_648;
pub(crate) const REPEAT: u32 = 10_497;

pub(crate) fn sampler(filter: u32, wrap: [u32; 2]) -> Value {
    json!({ "magFilter": filter, "wrapS": wrap[0], "wrapT": wrap[1] })
}

/// Binary files, each about one thing, by their names. They import without a warning.
pub fn textured() -> Vec<(&'static str, Vec<u8>)> {
    let smooth = || sampler(LINEAR, [REPEAT; 2]);
    let with = |subject: Value, textures: &[(Vec<u8>, Value)]| {
        let mut file = stage(subject);
        for (image, sampler) in textures {
            file.texture(image, sampler.clone());
        }
        file
    };
    let base = |info: Value, sampler: Value| with(painted(info), &[(colors(), sampler)]);
    let moved = json!({ "offset": [0.3, -0.2], "rotation": 0.5, "scale": [1.5, 0.7] });
    let moved = json!({ "index": 0, "extensions": { "KHR_texture_transform": moved } });
    let metal = json!({ "pbrMetallicRoughness": { "metallicRoughnessTexture": { "index": 0 },
        "baseColorFactor": [0.9, 0.7, 0.3, 1.0] } });
    let mut bumpy = painted(json!({ "index": 1 }));
    bumpy["normalTexture"] = json!({ "index": 0, "scale": 0.7 });
    let glowing = json!({ "emissiveTexture": { "index": 0 }, "emissiveFactor": [1.0, 0.5, 1.0], "doubleSided": true,
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 3.0 } } });
    let leaf = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 }, "extensions": {
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.4, "diffuseTransmissionColorFactor": [0.4, 0.9, 0.3] } } });
    let coat = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.4 }, "extensions": {
        "KHR_materials_specular": { "specularFactor": 0.8, "specularColorFactor": [1.0, 3.0, 0.5],
            "specularTexture": { "index": 0 }, "specularColorTexture": { "index": 1 } } } });
    let files = [
        ("nearest", base(json!({ "index": 0 }), sampler(NEAREST, [REPEAT; 2]))),
        ("linear", base(json!({ "index": 0 }), smooth())),
        ("mirror-clamp", base(json!({ "index": 0 }), sampler(LINEAR, [MIRROR, CLAMP]))),
        ("clamp-mirror-nearest", base(json!({ "index": 0 }), sampler(NEAREST, [CLAMP, MIRROR]))),
        ("transform", base(moved.clone(), smooth())),
        ("jpeg", with(painted(json!({ "index": 0 })), &[(JPEG.to_vec(), smooth())])),
        ("metallic-roughness", with(metal, &[(metallic_roughness(), smooth())])),
        ("normal-map", with(bumpy, &[(bumps(), smooth()), (colors(), smooth())])),
        ("emission", with(glowing, &[(colors(), sampler(NEAREST, [REPEAT; 2]))])),
        ("coat", with(coat, &[(translucent(), smooth()), (colors(), smooth())])),
        ("glass", stage(glass())),
        ("leaf", stage(leaf)),
        ("lights", lights()),
        ("everything", everything(moved)),
    ];
    files.map(|(name, file)| (name, file.glb())).into()
}

/// A box on a diffuse stage, of a material like those of Khronos' sample assets for light that scatters inside: of the older draft, where light enters by
/// diffuse transmission; of the newer one, by specular transmission; of the older one with textures. They import without a warning.
pub fn scattering() -> Vec<(&'static str, Vec<u8>)> {
    let volume = json!({ "thicknessFactor": 1.0, "attenuationDistance": 0.1, "attenuationColor": [0.7, 0.4, 0.2] });
    let inside = |extensions: Value| {
        let mut material = json!({ "name": "inside", "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
            "extensions": extensions });
        material["extensions"]["KHR_materials_volume"] = volume.clone();
        material
    };
    let color = json!([0.9, 0.6, 0.4]);
    let diffuse = json!({ "diffuseTransmissionFactor": 1.0 });
    let older = inside(json!({ "KHR_materials_ior": { "ior": 1.0 }, "KHR_materials_diffuse_transmission": diffuse,
        "KHR_materials_volume_scatter": { "multiscatterColor": color, "scatterAnisotropy": 0.3 } }));
    let newer = inside(
        json!({ "KHR_materials_ior": { "ior": 1.4 }, "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_scatter": { "multiscatterColorFactor": color, "scatterStrengthFactor": 0.9, "scatterAnisotropy": -0.2 } }),
    );
    let textured = inside(json!({ "KHR_materials_ior": { "ior": 1.0 }, "KHR_materials_diffuse_transmission": diffuse,
        "KHR_materials_volume_scatter": { "multiscatterColor": [1.0, 1.0, 1.0], "multiscatterColorTexture": { "index": 0 } } }));
    let files = [("diffuse-entry", older), ("dielectric", newer), ("textured-medium", textured)];
    files
        .map(|(name, material)| {
            let mut file = File::stage(json!([painted(json!({ "index": 0 })), lamp(), material]));
            file.texture(&colors(), sampler(LINEAR, [REPEAT; 2]));
            file.solid("inside", [[-0.4, 0.1, -0.3], [0.4, 0.9, 0.3]], 2);
            (name, file.glb())
        })
        .into()
}

fn glass() -> Value {
    json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 }, "extensions": {
        "KHR_materials_ior": { "ior": 1.45 },
        "KHR_materials_transmission": { "transmissionFactor": 0.95 },
        "KHR_materials_volume": {
            "thicknessFactor": 1.0, "attenuationDistance": 0.5, "attenuationColor": [0.6, 0.9, 0.7] } } })
}

/// A point, a spot and a directional light, the last two turned to shine down and to the back.
fn lights() -> File {
    let mut file = stage(json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.8 } }));
    file.document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "intensity": 2.0, "color": [1.0, 0.4, 0.2] },
        { "type": "spot", "intensity": 9.0, "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.6 } },
        { "type": "directional", "intensity": 0.5, "color": [0.3, 0.5, 1.0] },
    ] } });
    for (light, rotation) in [(0, [0.0, 0.0, 0.0, 1.0]), (1, [-0.6, 0.0, 0.0, 0.8]), (2, [-0.28, 0.0, 0.0, 0.96])] {
        file.add(
            "nodes",
            json!({ "translation": [0.4 * f64::from(light) - 0.4, 1.5, 0.3], "rotation": rotation,
                "extensions": { "KHR_lights_punctual": { "light": light } } }),
        );
    }
    file
}

/// All textures in one material, and glass on the lamp's place.
fn everything(base_color: Value) -> File {
    let mut subject = painted(base_color);
    subject["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({ "index": 1 });
    subject["normalTexture"] = json!({ "index": 2 });
    subject["emissiveTexture"] = json!({ "index": 3 });
    subject["emissiveFactor"] = json!([0.1, 0.1, 0.2]);
    subject["extensions"] = json!({ "KHR_materials_specular": {
        "specularTexture": { "index": 4 }, "specularColorTexture": { "index": 0 } } });
    let mut file = File::stage(json!([subject, lamp(), glass()]));
    let pane = [[-0.6, 0.2, 0.3], [0.6, 0.2, 0.3], [0.6, 1.2, 0.1], [-0.6, 1.2, 0.1]];
    file.quad("pane", pane, None, 1.0, 2);
    for image in [colors(), metallic_roughness(), bumps(), JPEG.to_vec(), translucent()] {
        file.texture(&image, sampler(LINEAR, [REPEAT, MIRROR]));
    }
    file
}

/// Writes a `.gltf` file into a folder, with its buffer and its images, a PNG and a JPEG, in files of their own.
///
/// # Errors
/// As of [`std::fs::write`].
pub fn external(folder: &Path) -> io::Result<PathBuf> {
    let mut subject = painted(json!({ "index": 0 }));
    subject["emissiveTexture"] = json!({ "index": 1 });
    subject["emissiveFactor"] = json!([0.2, 0.2, 0.2]);
    let mut file = stage(subject);
    for (name, image) in [("four colours.png", colors()), ("checker.jpg", JPEG.to_vec())] {
        std::fs::write(folder.join(name), image)?;
        let image = file.add("images", json!({ "uri": name.replace(' ', "%20") }));
        file.add("textures", json!({ "source": image }));
    }
    let File { mut document, bytes } = file.finished();
    document["buffers"][0]["uri"] = json!("stage.bin");
    std::fs::write(folder.join("stage.bin"), bytes)?;
    let path = folder.join("stage.gltf");
    std::fs::write(&path, document.to_string())?;
    Ok(path)
}

/// The scene with its meshes, groups and textures numbered as they are used, as the importer does, and without what is not
/// used: equal renderings have equal ones.
pub fn renumbered(scene: &Scene) -> Scene {
    let mut result = Scene { meshes: Vec::new(), textures: Vec::new(), ..scene.clone() };
    let mut textures = BTreeMap::new();
    for material in &mut result.materials {
        let slots = [
            &mut material.base_color_texture,
            &mut material.metallic_roughness_texture,
            &mut material.normal_texture,
            &mut material.emission_texture,
            &mut material.specular_texture,
            &mut material.specular_color_texture,
        ];
        for texture_use in slots.into_iter().flatten() {
            let own = textures.entry(texture_use.texture).or_insert_with(|| {
                result.textures.push(scene.textures[texture_use.texture].clone());
                result.textures.len() - 1
            });
            texture_use.texture = *own;
        }
        material.two_sided_emission &= material.emission != [0.0; 3];
    }
    let (mut meshes, mut groups) = (BTreeMap::new(), BTreeMap::new());
    result.instances.retain(|instance| !scene.meshes[instance.mesh].indices.is_empty());
    for instance in &mut result.instances {
        instance.mesh = *meshes.entry(instance.mesh).or_insert_with(|| {
            result.meshes.push(scene.meshes[instance.mesh].clone());
            result.meshes.len() - 1
        });
        let next = groups.len() as u32;
        instance.group = instance.group.map(|group| *groups.entry(group).or_insert(next));
    }
    result
}

/// The first line in which two scenes differ when all of their numbers are written out; every bit counts. The name and
/// the environment, which a file does not have, do not.
pub fn difference(a: &Scene, b: &Scene) -> Option<String> {
    fn each<T: Debug>(parts: &[T]) -> Vec<String> {
        parts.iter().map(|part| format!("{part:?}")).collect()
    }
    let lines = |scene: &Scene| {
        let Scene { meshes, instances, materials, textures, lights, camera, default_size, .. } = renumbered(scene);
        let view = each(&[(camera, default_size)]);
        [each(&meshes), each(&instances), each(&materials), each(&textures), each(&lights), view].concat()
    };
    let (a, b) = (lines(a), lines(b));
    if a.len() != b.len() {
        return Some(format!("{} parts and {} parts", a.len(), b.len()));
    }
    let short = |text: &str| text.chars().take(300).collect::<String>();
    a.iter().zip(&b).find(|(a, b)| a != b).map(|(a, b)| format!("{}\n{}", short(a), short(b)))
}
