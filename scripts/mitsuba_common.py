"""What the comparisons with Mitsuba 3 share: running both renderers on one scene, and reading their images."""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path


def use_llvm_of_rust():
    """Lets llvm_ad_rgb take the LLVM library of the Rust toolchain, unless the environment names another: what distributions
    have is often too old (version 15 aborts on processors with AVX-512)."""
    if shutil.which("rustc"):
        root = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True).stdout.strip()
        for library in sorted(Path(root, "lib").glob("libLLVM.so.*")):
            os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(library))


# Mitsuba looks for it as it is loaded.
use_llvm_of_rust()

import mitsuba as mi
import numpy as np


def restir(program, scene, size, spp, depth, seed, output, env=None, settings=()):
    """Traces paths with `restir` over the area of pixels; returns the image and the seconds of rendering."""
    words = ["--jitter", "--spp", str(spp), "--max-depth", str(depth)]
    return restir_render(program, scene, size, seed, output, env, settings, words)


def restir_render(program, scene, size, seed, output, env=None, settings=(), words=()):
    """Renders with `restir` and what `words` ask for; returns the image and the seconds that the program reports for
    rendering, which hold neither loading nor building. They follow from its rate, which has more digits than its seconds."""
    command = [program, "render", str(scene), "-o", str(output), "--device", "cpu", *words]
    command += ["--size", f"{size[0]}x{size[1]}", "--seed", str(seed)]
    command += ["--env", str(env)] if env else []
    command += [word for setting in settings for word in ("--set", setting)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or f"restir ended with {done.returncode}")
    count, rate = re.search(r" with (\d+) \w+ in .* \(([0-9.e+]+) samples/s\)", done.stdout).groups()
    return read_exr(output), size[0] * size[1] * int(count) / float(rate)


def read_exr(path):
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(bitmap, dtype=np.float64)


def mitsuba_cornell_box(size):
    """`mi.cornell_box()` with a box filter. Surfaces are two-sided, as they are in restir."""
    scene = mi.cornell_box()
    for name, entry in list(scene.items()):
        if isinstance(entry, dict) and entry.get("type") == "diffuse":
            scene[name] = {"type": "twosided", "bsdf": entry}
    scene["sensor"]["film"] = film(size)
    scene["sensor"]["sampler"] = {"type": "independent"}
    scene.pop("integrator", None)
    return scene


def film(size):
    return {
        "type": "hdrfilm",
        "width": size[0],
        "height": size[1],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }


def path_tracer(depth):
    """As restir's: next event estimation with multiple importance sampling, and no roulette."""
    return mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": depth + 1})


def mitsuba_problem(variant):
    """Why Mitsuba cannot render with this variant here, or None. In a process of its own: LLVM may abort."""
    probe = f"import mitsuba as mi; mi.set_variant('{variant}'); mi.render(mi.load_dict(mi.cornell_box()), spp=1).numpy()"
    if variant.startswith("scalar"):
        return None
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True)
    errors = [line for line in done.stderr.splitlines() if line.strip()]
    return None if done.returncode == 0 else next((e for e in errors if "ERROR" in e), errors[-1] if errors else "it ended")


def mitsuba(scene, integrator, spp, seed, sensor=0):
    return np.array(mi.render(scene, sensor=sensor, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)[..., :3]


def t_quantile(p, freedom):
    """Student's t with `freedom` degrees: where the upper tail has probability `p`."""
    # a substitution that maps the half line to (0, 1), then the trapezoidal rule
    s = np.linspace(0, 1, 200_001)[:-1]
    x = s / (1 - s)
    density = (1 + x * x / freedom) ** (-(freedom + 1) / 2) / (1 - s) ** 2
    cumulated = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    upper = 0.5 * (1 - cumulated / cumulated[-1])
    return float(np.interp(-np.log(p), -np.log(np.maximum(upper, 1e-300)), x))


def write_png(path, image):
    """Linear radiance to an sRGB PNG."""
    bitmap = mi.Bitmap(np.ascontiguousarray(image, dtype=np.float32))
    bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True)
    bitmap.write(str(path))


def commit():
    """The commit that was measured, with a + if files differ from it."""
    git = lambda *arguments: subprocess.run(["git", *arguments], capture_output=True, text=True).stdout.strip()
    return git("rev-parse", "--short=10", "HEAD") + ("+" if git("status", "--porcelain", "--untracked-files=no") else "")


def cpu():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else 'unknown CPU'}, {os.cpu_count()} hardware threads"


def write_atomically(path, text):
    path = Path(path)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
        file.write(text)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


class Object:
    """A faceted mesh with a material, given as the arguments of `material_gltf` and `material_mitsuba`."""

    def __init__(self, positions, triangles, uvs=None, **material):
        self.positions = np.asarray(positions, dtype=np.float32)
        self.triangles = np.asarray(triangles, dtype=np.uint32)
        self.uvs = None if uvs is None else np.asarray(uvs, dtype=np.float32)
        self.material = material


def quad(corner, u, v, **material):
    corner, u, v = (np.asarray(x, dtype=np.float64) for x in (corner, u, v))
    positions = [corner, corner + u, corner + u + v, corner + v]
    return Object(positions, [[0, 1, 2], [0, 2, 3]], [[0, 0], [1, 0], [1, 1], [0, 1]], **material)


def box(lo, hi, **material):
    """Between two corners, front sides out."""
    corners = np.array([[x, y, z] for x in (lo[0], hi[0]) for y in (lo[1], hi[1]) for z in (lo[2], hi[2])], dtype=np.float64)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Object(corners, [t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])], **material)


def sphere(centre, radius, rings=48, **material):
    """A closed sphere of facets, front sides out."""
    segments = 2 * rings
    theta = np.pi * np.arange(1, rings) / rings
    phi = 2 * np.pi * np.arange(segments) / segments
    grid = [
        np.outer(np.sin(theta), np.cos(phi)),
        np.outer(np.cos(theta), np.ones(segments)),
        np.outer(np.sin(theta), np.sin(phi)),
    ]
    points = np.concatenate([[[0, 1, 0]], np.stack(grid, -1).reshape(-1, 3), [[0, -1, 0]]])
    last = len(points) - 1
    at = lambda ring, k: 1 + ring * segments + k % segments
    triangles = []
    for k in range(segments):
        triangles += [[0, at(0, k + 1), at(0, k)], [last, at(rings - 2, k), at(rings - 2, k + 1)]]
        for ring in range(rings - 2):
            a, b, c, d = at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)
            triangles += [[a, b, d], [a, d, c]]
    return Object(np.asarray(centre) + radius * points, triangles, **material)


def write_glb(path, objects, camera, texture_png=None):
    """The objects and a camera {position, target, yfov} as a glTF 2.0 binary file."""
    blob, views, accessors, meshes, nodes, materials = bytearray(), [], [], [], [], []

    def view(data):
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob.extend(data + b"\0" * (-len(data) % 4))
        return len(views) - 1

    def accessor(array, component, kind):
        entry = {"bufferView": view(array.tobytes()), "componentType": component, "type": kind, "count": len(array)}
        if kind == "VEC3":
            entry |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    for object in objects:
        attributes = {"POSITION": accessor(object.positions, 5126, "VEC3")}
        if object.uvs is not None:
            attributes["TEXCOORD_0"] = accessor(object.uvs, 5126, "VEC2")
        indices = object.triangles.reshape(-1)
        accessors.append(
            {"bufferView": view(indices.tobytes()), "componentType": 5125, "type": "SCALAR", "count": len(indices)}
        )
        primitive = {"attributes": attributes, "indices": len(accessors) - 1, "material": len(materials)}
        materials.append(material_gltf(**object.material))
        nodes.append({"mesh": len(meshes)})
        meshes.append({"primitives": [primitive]})
    nodes.append({"camera": 0, "matrix": camera_matrix(camera).T.reshape(-1).tolist()})
    gltf = {
        "asset": {"version": "2.0"},
        "extensionsUsed": sorted({name for m in materials for name in m.get("extensions", {})}),
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "cameras": [{"type": "perspective", "perspective": {"yfov": camera["yfov"], "znear": 0.01}}],
    }
    if texture_png:
        gltf["images"] = [{"bufferView": view(Path(texture_png).read_bytes()), "mimeType": "image/png"}]
        gltf["samplers"] = [{"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497}]
        gltf["textures"] = [{"source": 0, "sampler": 0}]
    gltf |= {"accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob)}]}
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(blob)
    header = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON")
    Path(path).write_bytes(header + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob)


def camera_matrix(camera):
    position, target = (np.asarray(camera[key], dtype=np.float64) for key in ("position", "target"))
    back = (position - target) / np.linalg.norm(position - target)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, position
    return matrix


def multiscatter_color(albedo, anisotropy):
    """What a half space reflects whose collisions scatter the part `albedo`, by van de Hulst's formula: glTF has media by it."""
    s = np.sqrt((1 - np.asarray(albedo)) / (1 - anisotropy * np.asarray(albedo)))
    return ((1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s)).tolist()


def medium_gltf(index, extinction, albedo, anisotropy, roughness=0.0):
    """A surface, smooth unless it has a roughness, with a medium behind it."""
    # of colours that are almost black glTF readers see no difference: what is left is told at a distance where much is
    distance = 1.0 / max(extinction)
    return {
        "KHR_materials_ior": {"ior": index},
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {
            "thicknessFactor": 1.0,
            "attenuationDistance": distance,
            "attenuationColor": np.exp(-distance * np.asarray(extinction)).tolist(),
        },
        "KHR_materials_volume_scatter": {
            "multiscatterColorFactor": multiscatter_color(albedo, anisotropy),
            "scatterAnisotropy": anisotropy,
        },
    }


def medium_mitsuba(index, extinction, albedo, anisotropy, roughness=0.0):
    """As `medium_gltf`: the members of a shape."""
    scale = max(extinction)
    medium = {
        "type": "homogeneous",
        "scale": scale,
        "sigma_t": {"type": "rgb", "value": [rate / scale for rate in extinction]},
        "albedo": {"type": "rgb", "value": list(albedo)},
        "phase": {"type": "hg", "g": anisotropy} if anisotropy != 0 else {"type": "isotropic"},
    }
    if index == 1:
        return {"interior": medium, "bsdf": {"type": "null"}}
    # glTF: GGX's alpha is the square of the roughness
    rough = {"type": "roughdielectric", "distribution": "ggx", "alpha": roughness**2}
    bsdf = (rough if roughness > 0 else {"type": "dielectric"}) | {"int_ior": index, "ext_ior": 1.0}
    return {"interior": medium, "bsdf": bsdf}


def volume_path_tracer(kind="volpath"):
    """`volpathmis` weights distances by the densities of all channels, as restir does; `volpath` takes one channel's for all three."""
    return mi.load_dict({"type": kind, "max_depth": -1, "rr_depth": 16})


def material_gltf(kind, color=(1, 1, 1), roughness=1.0, textured=False, emission=None, metallic=0.0, medium=None):
    """`kind` is "diffuse", "metal" (white: Schlick's Fresnel term is one), "glass" (smooth, index 1.5) or "principled" (index
    1.5, of the metalness `metallic`), or "medium", of the arguments `medium` of `medium_gltf`. `emission` is a radiance, grey or of
    three channels."""
    if kind == "medium":
        rough = medium.get("roughness", 0.0)
        pbr = {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0.0, "roughnessFactor": rough}
        return {"pbrMetallicRoughness": pbr, "extensions": medium_gltf(**medium)}
    pbr = {
        "baseColorFactor": [*color, 1.0],
        "metallicFactor": 1.0 if kind == "metal" else metallic,
        "roughnessFactor": {"diffuse": 1.0, "glass": 0.0}.get(kind, roughness),
    }
    if textured:
        pbr["baseColorTexture"] = {"index": 0}
    material = {"pbrMetallicRoughness": pbr, "extensions": {}}
    if kind != "metal":
        # with an index of 1 nothing is reflected specularly
        material["extensions"]["KHR_materials_ior"] = {"ior": 1.0 if kind == "diffuse" else 1.5}
    if kind == "glass":
        material["extensions"]["KHR_materials_transmission"] = {"transmissionFactor": 1.0}
        material["extensions"]["KHR_materials_volume"] = {"thicknessFactor": 1.0}
    if emission is not None:
        strength = float(np.max(emission))
        material["emissiveFactor"] = (np.broadcast_to(emission, 3) / strength).tolist()
        material["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    return material


def material_mitsuba(texture_png, kind, color=(1, 1, 1), roughness=1.0, textured=False, emission=None, metallic=0.0):
    if kind == "metal":
        # glTF: GGX's alpha is the square of the roughness
        rough = {"type": "roughconductor", "distribution": "ggx", "alpha": roughness**2}
        bsdf = (rough if roughness > 0 else {"type": "conductor"}) | {"material": "none"}
    elif kind == "principled":
        color = {"type": "rgb", "value": list(color)}
        bsdf = {"type": "principled", "base_color": color, "roughness": roughness, "metallic": metallic, "eta": 1.5}
    elif kind == "glass":
        return {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
    elif textured:
        texture = {"type": "bitmap", "filename": str(texture_png), "filter_type": "bilinear", "wrap_mode": "repeat"}
        bsdf = {"type": "diffuse", "reflectance": texture}
    else:
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}
    return {"type": "twosided", "bsdf": bsdf}


def mitsuba_scene(folder, objects, camera, size, env=None, texture_png=None):
    """The same as a Mitsuba scene; meshes go through PLY files in `folder`."""
    to_world = mi.ScalarTransform4f().look_at(camera["position"], camera["target"], [0, 1, 0])
    sensor = {"type": "perspective", "fov_axis": "y", "fov": float(np.degrees(camera["yfov"])), "to_world": to_world}
    scene = {"type": "scene", "sensor": sensor | {"film": film(size), "sampler": {"type": "independent"}}}
    if env:
        scene["environment"] = {"type": "envmap", "filename": str(env)}
    for index, object in enumerate(objects):
        path = Path(folder) / f"{index}.ply"
        write_ply(path, object)
        shape = {"type": "ply", "filename": str(path), "face_normals": True}
        if object.material["kind"] == "medium":
            scene[f"object{index}"] = shape | medium_mitsuba(**object.material["medium"])
            continue
        scene[f"object{index}"] = shape | {"bsdf": material_mitsuba(texture_png, **object.material)}
        if object.material.get("emission") is not None:
            radiance = {"type": "rgb", "value": np.broadcast_to(object.material["emission"], 3).tolist()}
            scene[f"object{index}"]["emitter"] = {"type": "area", "radiance": radiance}
    return scene


def write_ply(path, object):
    # both have v = 0 at the image's first row
    uvs = np.zeros((len(object.positions), 2), np.float32) if object.uvs is None else object.uvs
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "u", "v"))
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(uvs)}\n{names}"
    header += f"element face {len(object.triangles)}\nproperty list uchar int vertex_index\nend_header\n"
    faces = np.zeros(len(object.triangles), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, object.triangles
    vertices = np.concatenate([object.positions, uvs], axis=1).astype("<f4")
    Path(path).write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def plain_scene(program, scene, folder, env=None):
    """A scene of `restir` in what both renderers have alike, as (objects, camera, texture, environments): faceted, what is
    coated is only diffuse, metals are white and at most of roughness 0.3, glass is smooth and clear.

    The two environments are restir's and Mitsuba's file of the same radiance; objects of one material are one."""
    path = Path(folder) / "exported.glb"
    path.parent.mkdir(exist_ok=True)
    command = [program, "export", str(scene), str(path), *(["--env", str(env)] if env else [])]
    subprocess.run(command, check=True, capture_output=True)
    gltf, blob = read_glb(path)
    parts = {}
    for node in gltf["nodes"]:
        for primitive in gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            material = gltf["materials"][primitive["material"]]
            plain = plain_material(material)
            part = placed(gltf, blob, node, primitive, material if plain.get("textured") else None)
            parts.setdefault(json.dumps(plain), []).append(part)
    objects = [merged(list_, json.loads(key)) for key, list_ in parts.items()]
    camera = gltf["cameras"][0]["extras"]["restir"]
    camera = {"position": camera["position"], "target": camera["target"], "yfov": camera["verticalFov"]}
    environment = path.with_suffix(".env.exr")
    environments = both_environments(environment) if environment.exists() else None
    return objects, camera, sharp_texture(gltf, blob, folder), environments


def read_glb(path):
    """The JSON and the binary chunk of a glTF 2.0 binary file."""
    data = Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def plain_material(material):
    """The arguments of `material_gltf` that come nearest to a material of glTF."""
    surface, extensions = material["pbrMetallicRoughness"], material["extensions"]
    if np.any(material["emissiveFactor"]):
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        emission = [channel * strength for channel in material["emissiveFactor"]]
        return {"kind": "diffuse", "color": surface["baseColorFactor"][:3], "emission": emission}
    if "KHR_materials_transmission" in extensions:
        return {"kind": "glass"}
    if surface["metallicFactor"] == 1.0:
        return {"kind": "metal", "roughness": min(surface["roughnessFactor"], 0.3)}
    if "baseColorTexture" in surface:
        return {"kind": "diffuse", "textured": True}
    return {"kind": "diffuse", "color": surface["baseColorFactor"][:3]}


def placed(gltf, blob, node, primitive, textured):
    """Positions in the world, triangles and texture coordinates (where the material `textured` has them) of a primitive."""

    def array(index):
        accessor = gltf["accessors"][index]
        start = gltf["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        kind = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
        columns = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
        return np.frombuffer(blob, kind, accessor["count"] * columns, start).reshape(-1, columns)

    matrix = np.array(node.get("matrix", np.eye(4).reshape(-1))).reshape(4, 4).T
    attributes = primitive["attributes"]
    positions = array(attributes["POSITION"]) @ matrix[:3, :3].T + matrix[:3, 3]
    uvs = np.zeros((len(positions), 2))
    if textured:
        transform = textured["pbrMetallicRoughness"]["baseColorTexture"].get("extensions", {})
        transform = transform.get("KHR_texture_transform", {})
        uvs = array(attributes["TEXCOORD_0"]) * transform.get("scale", 1.0) + transform.get("offset", 0.0)
    return positions, array(primitive["indices"]).reshape(-1, 3).astype(np.int64), uvs


def merged(parts, material):
    """One object of (positions, triangles, texture coordinates)s that have one material."""
    first = np.cumsum([0] + [len(positions) for positions, _, _ in parts[:-1]])
    positions, triangles, uvs = zip(*parts)
    triangles = np.concatenate([t + start for t, start in zip(triangles, first)])
    return Object(np.concatenate(positions), triangles, np.concatenate(uvs), **material)


def sharp_texture(gltf, blob, folder):
    """The file's texture, or None, with its texels repeated: both renderers interpolate, where the file's is not."""
    if "images" not in gltf:
        return None
    view = gltf["bufferViews"][gltf["images"][0]["bufferView"]]
    path = Path(folder) / "texture.png"
    path.write_bytes(blob[view.get("byteOffset", 0) :][: view["byteLength"]])
    texels = np.array(mi.Bitmap(str(path)))[..., :3]
    mi.Bitmap(texels.repeat(128, axis=0).repeat(128, axis=1)).write(str(path))
    return path


def both_environments(path):
    """Files of one radiance for restir and Mitsuba 3, of which the first has a map's rows in their middles and the second
    has the first and the last at the poles. Both interpolate linearly, so the second is given the rows and what is between
    them; radiance is not negative."""
    rows = np.maximum(read_exr(path), 0).astype(np.float32)
    between = np.concatenate([rows[:1], (rows[1:] + rows[:-1]) / 2, rows[-1:]])
    interleaved = np.empty((2 * len(rows) + 1, *rows.shape[1:]), np.float32)
    interleaved[0::2], interleaved[1::2] = between, rows
    paths = path.with_name("environment.exr"), path.with_name("environment-mitsuba.exr")
    for file, image in zip(paths, (rows, interleaved)):
        mi.Bitmap(image).write(str(file))
    return paths
