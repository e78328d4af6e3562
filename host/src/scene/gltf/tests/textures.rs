//! Images, samplers and texture transforms.

use super::exact::PlacedTexture;
use super::*;
use crate::scene::{Filter, Texels, TextureUse, UvSet, Wrap};

/// A checkerboard of 8 x 8 texels in 16 x 16; each as another kind of JPEG.
const RGB: &[u8] = include_bytes!("files/checker.jpg");
const PROGRESSIVE: &[u8] = include_bytes!("files/checker-progressive-420.jpg");
const GREY: &[u8] = include_bytes!("files/checker-grey.jpg");
const CMYK: &[u8] = include_bytes!("files/checker-cmyk.jpg");

const ROOM: u64 = 1 << 30;

fn png(color: png::ColorType, depth: png::BitDepth, [width, height]: [u32; 2], data: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![10, 20, 30, 40, 50, 60]);
        encoder.set_trns(vec![255, 7]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    file
}

fn texels(file: &[u8]) -> Texels {
    image::decode(file, ROOM).unwrap().texels
}

#[test]
fn every_kind_of_png() {
    use png::{BitDepth, ColorType};
    let read = |color, depth, data: &[u8]| match texels(&png(color, depth, [2, 1], data)) {
        Texels::Eight(texels) => texels.to_vec(),
        Texels::Sixteen(texels) => panic!("{texels:?} have sixteen bits"),
    };
    let eight = BitDepth::Eight;
    assert_eq!(read(ColorType::Rgba, eight, &[1, 2, 3, 4, 5, 6, 7, 8]), [[1, 2, 3, 4], [5, 6, 7, 8]]);
    assert_eq!(read(ColorType::Rgb, eight, &[1, 2, 3, 4, 5, 6]), [[1, 2, 3, 255], [4, 5, 6, 255]]);
    assert_eq!(read(ColorType::Grayscale, eight, &[9, 8]), [[9, 9, 9, 255], [8, 8, 8, 255]]);
    assert_eq!(read(ColorType::GrayscaleAlpha, eight, &[9, 1, 8, 2]), [[9, 9, 9, 1], [8, 8, 8, 2]]);
    assert_eq!(read(ColorType::Grayscale, BitDepth::Two, &[0b0110_0000]), [[85, 85, 85, 255], [170, 170, 170, 255]]);
    assert_eq!(read(ColorType::Indexed, BitDepth::One, &[0b0100_0000]), [[10, 20, 30, 255], [40, 50, 60, 7]]);
}

#[test]
fn sixteen_bits_are_kept_where_eight_do_not_hold_them() {
    use png::{BitDepth, ColorType};
    let read = |color, data: &[u8]| texels(&png(color, BitDepth::Sixteen, [2, 1], data));
    let grey = read(ColorType::Grayscale, &[0x7f, 0xff, 0x80, 0x80]);
    let expected = vec![[0x7fff, 0x7fff, 0x7fff, 0xffff], [0x8080, 0x8080, 0x8080, 0xffff]];
    assert_eq!(grey, Texels::Sixteen(expected.clone().into()));
    assert!(grey.iter().eq(expected));
    let whole = read(ColorType::GrayscaleAlpha, &[1, 1, 2, 2, 3, 3, 255, 255]);
    assert_eq!(whole, [[1, 1, 1, 2], [3, 3, 3, 255]].into());
    assert_eq!(whole.at(0), [257, 257, 257, 514]);
    assert_eq!((grey.bytes(), whole.bytes()), (16, 8));
}

#[test]
fn every_kind_of_jpeg() {
    let colors = [[200, 60, 40], [40, 90, 200]];
    for (file, colors, tolerance) in
        [(RGB, colors, 3), (PROGRESSIVE, colors, 12), (GREY, [[220; 3], [30; 3]], 2), (CMYK, colors, 4)]
    {
        let decoded = image::decode(file, ROOM).unwrap();
        assert_eq!(decoded.size, [16, 16]);
        for (x, y, color) in [(2, 2, colors[0]), (13, 2, colors[1]), (2, 13, colors[1]), (13, 13, colors[0])] {
            let texel = decoded.texels.at(16 * y + x).map(|channel| (channel / 257) as u8);
            let error = (0..3).map(|i| texel[i].abs_diff(color[i])).max().unwrap();
            assert!(error <= tolerance && texel[3] == 255, "{texel:?} is not {color:?}");
        }
    }
}

#[test]
fn broken_images_are_explained() {
    let file = png(png::ColorType::Rgb, png::BitDepth::Eight, [8, 8], &[7; 192]);
    let refused = |file: &[u8]| {
        let problem = image::decode(file, ROOM).map(|_| ()).unwrap_err();
        assert!(!problem.contains('\n'), "{problem}");
        problem
    };
    assert!(refused(b"RIFFxxxxWEBP").contains("neither"));
    assert!(refused(&file[..file.len() - 30]).contains("PNG"));
    assert!(refused(&file[..20]).contains("PNG"));
    for length in [4, 100, RGB.len() / 2, RGB.len() - 40] {
        assert!(refused(&RGB[..length]).contains("JPEG"), "{length}");
    }
}

#[test]
fn a_size_is_judged_before_anything_is_decoded() {
    // The header of a PNG, with a valid checksum of its chunk, and no data.
    let bomb = |side: u32| {
        let mut file = Vec::new();
        png::Encoder::new(&mut file, side, side).write_header().unwrap();
        file.truncate(33);
        file.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
        file
    };
    let problem = |file: &[u8], room| image::decode(file, room).map(|_| ()).unwrap_err();
    assert!(problem(&bomb(16_385), ROOM).contains("16385 x 16385"));
    assert!(problem(&bomb(16_384), ROOM - 1).contains("GiB"));
    // The height of a JPEG lies behind the marker of its frame.
    let mut tall = RGB.to_vec();
    let at = tall.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    tall[at + 5..at + 7].copy_from_slice(&[0xff, 0xff]);
    assert!(problem(&tall, ROOM).contains("16 x 65535"));
}

#[test]
fn changed_bytes_of_images_never_panic() {
    let png = png(png::ColorType::Indexed, png::BitDepth::One, [2, 1], &[0b0100_0000]);
    for file in [&png[..], RGB, PROGRESSIVE, CMYK] {
        for position in 0..file.len() {
            for value in [0, 0xff, file[position] ^ 1] {
                let mut changed = file.to_vec();
                changed[position] = value;
                // 64 KiB, so that a changed size does not make it slow.
                let _ = image::decode(&changed, 1 << 16);
            }
        }
    }
}

/// The square with a material, over the given members of the root.
fn of_material(material: &str, members: &str) -> String {
    let members = format!(r#""materials": [{{ {material} }}], {members},"#);
    square(&members, r#"{ "attributes": { "POSITION": 0 }, "mode": 6, "material": 0 }"#, ONE_NODE)
}

/// The square with a material of one texture.
fn textured(info: &str, members: &str) -> String {
    of_material(&format!(r#""pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 {info} }} }}"#), members)
}

const BASE64: &str = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";

fn embedded() -> String {
    format!(r#""textures": [{{ "source": 0 }}], "images": [{{ "uri": "data:image/png;base64,{BASE64}" }}]"#)
}

#[test]
fn samplers_are_read() {
    let members = embedded().replace(r#""source": 0"#, r#""source": 0, "sampler": 0"#)
        + r#", "samplers": [{ "wrapS": 33648, "wrapT": 33071, "magFilter": 9728 }]"#;
    let texture = &load(&textured("", &members)).unwrap().textures[0];
    assert_eq!((texture.wrap, texture.filter, texture.size), ([Wrap::Mirror, Wrap::Clamp], Filter::Nearest, [1, 1]));
    let plain = &load(&textured("", &embedded())).unwrap().textures[0];
    assert_eq!((plain.wrap, plain.filter), ([Wrap::Repeat; 2], Filter::Linear));
    assert!(problem(&textured("", &members.replace(r#""sampler": 0"#, r#""sampler": 2"#))).contains("sampler 2"));
}

#[test]
fn equal_textures_are_one() {
    let members = embedded().replace(r#"{ "source": 0 }"#, r#"{ "source": 0 }, { "source": 0 }"#);
    let info = r#" }, "metallicRoughnessTexture": { "index": 1"#;
    let scene = load(&textured(info, &members)).unwrap();
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(scene.materials[0].metallic_roughness_texture, Some(TextureUse::new(0)));
}

#[test]
fn textures_of_specular_reflection_are_read() {
    let with = |factor: &str, color: &str| {
        let members = format!(r#""specularTexture": {{ {factor} }}, "specularColorTexture": {{ {color} }}"#);
        of_material(&format!(r#""extensions": {{ "KHR_materials_specular": {{ {members} }} }}"#), &embedded())
    };
    let moved = r#""index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0] } }"#;
    let scene = load(&with(r#""index": 0"#, moved)).unwrap();
    let coat = &scene.materials[0];
    assert_eq!(coat.specular_texture, Some(TextureUse::new(0)));
    assert_eq!(coat.specular_color_texture.unwrap().transform, [1.0, 0.0, 0.5, 0.0, 1.0, 0.0]);
    assert!(!scene.warnings.iter().any(|warning| warning.contains("specular")), "{:?}", scene.warnings);
    let apart = load(&with(r#""index": 0, "texCoord": 1"#, moved)).unwrap();
    let sets = [apart.materials[0].specular_texture, apart.materials[0].specular_color_texture]
        .map(|used| used.unwrap().uv_set);
    assert_eq!(sets, [UvSet::Second, UvSet::First]);
    assert!(problem(&with(r#""index": 0"#, r#""index": 9"#)).contains("texture 9"));
}

#[test]
fn images_are_files_in_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("checker board.jpg"), RGB).unwrap();
    let import = |uri: &str| {
        let members = format!(r#""textures": [{{ "source": 0 }}], "images": [{{ "uri": "{uri}" }}]"#);
        import("test.gltf", textured("", &members).as_bytes(), Some(folder.path()))
    };
    assert_eq!(import("checker%20board.jpg").unwrap().textures[0].size, [16, 16]);
    assert!(import("missing.png").unwrap_err().contains("missing.png"));
    assert!(import("../secret.png").unwrap_err().contains("relative URI"));
}

#[test]
fn broken_references_of_textures_are_explained() {
    let members = embedded();
    assert!(problem(&textured("", r#""textures": []"#)).contains("texture 0"));
    assert!(problem(&textured("", r#""textures": [{}]"#)).contains("no PNG or JPEG"));
    assert!(problem(&textured("", &members.replace("base64,iVBO", "base64,AAAA"))).contains("image 0"));
    let huge = r#", "extensions": { "KHR_texture_transform": { "scale": [1e20, 1] } }"#;
    assert!(problem(&textured(huge, &members)).contains("transform"));
}

#[test]
fn a_third_set_of_texture_coordinates_is_told() {
    let rough = r#" }, "metallicRoughnessTexture": { "index": 0, "texCoord": 2"#;
    let two = load(&textured(rough, &embedded())).unwrap();
    assert_eq!(two.materials[0].metallic_roughness_texture.unwrap().uv_set, UvSet::Second);
    assert!(!two.warnings.iter().any(|warning| warning.contains("sets")), "{:?}", two.warnings);
    let material = format!(
        r#""pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 {rough} }} }}, "emissiveTexture": {{ "index": 0, "texCoord": 5 }}"#
    );
    let three = load(&of_material(&material, &embedded())).unwrap();
    let told = "its textures lie on the sets [0, 2, 5] of texture coordinates; set 0 is used for [5]";
    assert!(three.warnings.iter().any(|warning| warning.contains(told)), "{:?}", three.warnings);
    assert_eq!(three.materials[0].emission_texture.unwrap().uv_set, UvSet::First);
}

#[test]
fn a_transform_moves_texture_coordinates_as_in_the_example_of_its_specification() {
    // "This example utilizes only the lower left quadrant of the source image, rotated clockwise 90 degrees."
    let info = r#", "extensions": { "KHR_texture_transform": {
        "offset": [0, 1], "rotation": 1.57079632679, "scale": [0.5, 0.5], "texCoord": 3 } }"#;
    let scene = load(&textured(info, &embedded())).unwrap();
    assert!(scene.warnings[0].contains("no texture coordinates 3"), "{:?}", scene.warnings);
    let m = scene.materials[0].base_color_texture.unwrap().transform;
    let at = |u: f32, v: f32| [m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]];
    for (uv, expected) in
        [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0]), ([1.0, 1.0], [0.5, 0.5])]
    {
        let moved = at(uv[0], uv[1]);
        assert!((0..2).all(|i| (moved[i] - expected[i]).abs() < 1e-6), "{uv:?}: {moved:?}");
    }
}

#[test]
fn transforms_without_shear_have_a_place() {
    for rotation in [0.0, 0.5, -2.0, 3.0] {
        let placed = PlacedTexture { offset: [0.25, -3.0], rotation, scale: [2.0, 0.5] };
        let back = PlacedTexture::of(placed.transform());
        assert_eq!(back.offset, placed.offset);
        assert!((back.rotation - rotation).abs() < 1e-6 && (back.scale[0] - 2.0).abs() < 1e-6, "{back:?}");
        assert!((back.scale[1] - 0.5).abs() < 1e-6, "{back:?}");
    }
    let identity = PlacedTexture { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] };
    assert_eq!(identity.transform(), TextureUse::new(0).transform);
}
