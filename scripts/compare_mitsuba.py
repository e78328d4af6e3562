#!/usr/bin/env python3
"""Compares restir with Mitsuba 3, an independent renderer, on six scenes, and writes a report.

    pip install 'mitsuba==3.9.*' numpy
    cargo build --release --bin restir
    python3 scripts/compare_mitsuba.py --restir target/release/restir --out docs/mitsuba.md

Both render each scene several times with different seeds. Per tile and channel the two means are compared by Welch's
t-test, with the tiles' standard errors from the restarts and a family-wise false-alarm rate of 0.001 over all tests.
"""

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

import mitsuba_common as common
from mitsuba_common import quad, sphere

SIZE = [128, 128]
TILE = 16
DEPTH = 8
FAMILY_RATE = 1e-3
POWER = 0.99
SCENES = ["diffuse", "metal", "glass", "media", "slab", "rough-medium"]
# where light walks
MEDIA = ["media", "slab", "rough-medium"]


def smooth_environment(folder, height=512):
    """One radiance as two images, (restir's, Mitsuba's): where restir has the middles of its rows, Mitsuba 3 has the first
    and the last row at the poles. Low frequencies, so that the interpolation between pixels does not matter."""
    paths = folder / "environment.exr", folder / "environment-mitsuba.exr"
    width = 2 * height
    rows = np.arange(height)[:, None]
    phi = 2 * np.pi * (0.5 - (np.arange(width)[None, :] + 0.5) / width)
    for path, v in zip(paths, ((rows + 0.5) / height, rows / (height - 1))):
        x, y, z = np.sin(np.pi * v) * np.sin(phi), np.cos(np.pi * v) + 0 * phi, np.sin(np.pi * v) * np.cos(phi)
        mi.Bitmap(np.stack(environment(x, y, z), -1).astype(np.float32)).write(str(path))
    return paths


def environment(x, y, z):
    """Radiance from a unit direction: a gradient, a warm lobe at the right and a cold one at the left."""
    lobe = lambda d, k: np.exp(k * (x * d[0] + y * d[1] + z * d[2] - 1))
    warm, cold = lobe((0.6, 0.64, 0.48), 8), lobe((-0.8, 0.36, 0.48), 6)
    return 0.3 + 0.2 * y + 2.5 * warm, 0.35 + 0.2 * y + 2.2 * warm + 0.3 * x * x, 0.5 + 0.3 * y + 1.5 * cold


def texture(path):
    """Squares and a gradient, without symmetry: a texture that is mirrored or shifted is seen."""
    rows, columns = np.mgrid[0:32, 0:32]
    squares = ((rows // 4 + columns // 4) % 2) * 120
    pixels = np.stack([60 + squares + columns * 2, 60 + squares + rows * 2, 200 - squares], -1)
    mi.Bitmap(pixels.astype(np.uint8)).write(str(path))


def describe(name, folder):
    """(objects, camera, texture) of a scene that both renderers are given. The ground fills the picture: directly visible
    sky has no noise to hide the interpolation of its pixels."""
    image = folder / "texture.png"
    texture(image)
    camera = {"position": [0.5, 4.0, 4.8], "target": [0.05, 0.4, 0.0], "yfov": 0.5}

    def ground(**material):
        square = quad([-20, 0, 20], [40, 0, 0], [0, 0, -40], **material)
        square.uvs *= 12.0
        return square

    if name == "metal":
        objects = [
            ground(kind="diffuse", color=(0.5, 0.4, 0.3)),
            sphere([-0.68, 0.65, 0], 0.64, kind="metal", roughness=0.15),
            sphere([0.68, 0.65, 0], 0.64, kind="metal", roughness=0.3),
        ]
        return objects, camera, None
    if name in MEDIA:

        def body(x, index, extinction, albedo, anisotropy, roughness=0.0):
            medium = {"index": index, "extinction": extinction, "albedo": albedo, "anisotropy": anisotropy, "roughness": roughness}
            return sphere([x, 0.56, 0], 0.55, kind="medium", medium=medium)

    if name == "slab":
        # seen from the lit side and through: a wall of a medium on the ground
        wall = {"index": 1.0, "extinction": [1.0, 2.0, 4.0], "albedo": [0.9, 0.95, 0.8], "anisotropy": 0.5}
        objects = [
            ground(kind="diffuse", color=(0.5, 0.4, 0.3)),
            common.box([-1.8, 0.01, -0.5], [1.8, 1.4, 0.5], kind="medium", medium=wall),
        ]
        return objects, camera, None
    if name == "rough-medium":
        objects = [
            ground(kind="diffuse", color=(0.5, 0.4, 0.3)),
            body(-0.68, 1.33, [1.5, 2.5, 4.0], [0.99, 0.95, 0.8], 0.0, 0.3),
            body(0.68, 1.5, [6.0, 6.0, 6.0], [0.6, 0.9, 0.98], -0.3, 0.2),
        ]
        return objects, camera, None
    if name == "media":

        objects = [
            ground(kind="diffuse", color=(0.5, 0.4, 0.3)),
            body(-1.2, 1.0, [0.8, 2.0, 5.0], [0.95, 0.9, 0.7], 0.5),
            body(0.0, 1.33, [1.5, 2.5, 4.0], [0.99, 0.95, 0.8], 0.0),
            body(1.2, 1.5, [6.0, 6.0, 6.0], [0.6, 0.9, 0.98], -0.3),
        ]
        return objects, camera, None
    objects = [
        ground(kind="diffuse", textured=True),
        sphere([-0.5, 0.71, 0.1], 0.7, kind="glass"),
        sphere([0.8, 0.46, 0.3], 0.45, kind="diffuse", color=(0.7, 0.25, 0.2)),
        quad([-1.2, 3.2, 1.2], [0, 0, -2.4], [2.4, 0, 0], kind="diffuse", color=(0, 0, 0), emission=4.0),
    ]
    return objects, camera, image


def renderers(name, folder, arguments):
    """Two functions from a seed to an image."""
    output = folder / "restir.exr"
    program = arguments.restir
    if name == "diffuse":
        path, env = "cornell-mitsuba", None
        scene = mi.load_dict(common.mitsuba_cornell_box(SIZE))
    else:
        objects, camera, image = describe(name, folder)
        path = folder / "scene.glb"
        env, env_mitsuba = smooth_environment(folder)
        common.write_glb(path, objects, camera, image)
        scene = mi.load_dict(common.mitsuba_scene(folder, objects, camera, SIZE, env_mitsuba, image))
    # a walk inside of a body is one segment of restir's, and Mitsuba counts collisions: neither is to matter
    media = name in MEDIA
    integrator = common.volume_path_tracer(arguments.walker) if media else common.path_tracer(DEPTH)
    depth = 64 if media else DEPTH
    ours = lambda seed: common.restir(program, path, SIZE, arguments.spp, depth, seed, output, env, ["multiscatter=off"])[0]
    theirs = lambda seed: common.mitsuba(scene, integrator, arguments.spp, seed)
    return ours, theirs


def tiles(image):
    rows, columns = SIZE[1] // TILE, SIZE[0] // TILE
    return image.reshape(rows, TILE, columns, TILE, 3).mean(axis=(1, 3))


def compare(name, arguments):
    """Renders a scene `restarts` times with both, in turns; returns what the report says about it."""
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = renderers(name, Path(folder), arguments)
        images = {"restir": [], "mitsuba": []}
        for seed in range(1, arguments.restarts + 1):
            images["restir"].append(ours(seed))
            images["mitsuba"].append(theirs(seed))
    values = {key: np.array([tiles(image) for image in list_]) for key, list_ in images.items()}
    mean = {key: value.mean(axis=0) for key, value in values.items()}
    variance = {key: value.var(axis=0, ddof=1) / arguments.restarts for key, value in values.items()}
    error = np.sqrt(variance["restir"] + variance["mitsuba"])
    difference = mean["restir"] - mean["mitsuba"]
    t = np.divide(difference, error, out=np.where(difference == 0, 0.0, np.inf), where=error > 0)
    # Welch's degrees of freedom are at least those of one of the two
    limit = common.t_quantile(FAMILY_RATE / (2 * t.size * len(SCENES)), arguments.restarts - 1)
    detectable = (limit + statistics.NormalDist().inv_cdf(POWER)) * error / mean["mitsuba"]
    averages = [np.mean(images[key], axis=0) for key in ("restir", "mitsuba")]
    picture = arguments.out.parent / f"mitsuba-{name}.png"
    common.write_png(picture, np.concatenate(averages, axis=1))
    return {
        "tests": t.size,
        "max": float(np.abs(t).max()),
        "limit": limit,
        "rms": float(np.sqrt(np.mean(t * t))),
        "detectable": [float(np.median(detectable)), float(detectable.max())],
        "ratio": float(mean["restir"].mean() / mean["mitsuba"].mean()),
        "picture": picture.name,
    }


LINES = {
    "diffuse": "the built-in `cornell-mitsuba` against `mi.cornell_box()` with two-sided surfaces",
    "metal": "two spheres of a white rough conductor (GGX, roughness 0.15 and 0.3) on the ground, under an environment map",
    "media": "three spheres on the ground under an environment map, with media of their own: index-matched, of the anisotropy 0.5; of the"
    " index 1.33; of the index 1.5 and the anisotropy -0.3; coefficients differ by channel; paths as long as they go",
    "slab": "a wall of an index-matched medium, 1, 2 and 4 mean free paths thick, of the anisotropy 0.5, under an environment map",
    "rough-medium": "two spheres of media behind rough dielectrics (GGX): of the index 1.33 and the roughness 0.3; of 1.5, 0.2 and the anisotropy -0.3",
    "glass": "a sphere of smooth glass (index 1.5) and a diffuse one on textured ground, an area light, an environment map",
}


def report(results, arguments, seconds):
    lines = [
        "# restir and Mitsuba 3",
        "",
        "Written by `python3 scripts/compare_mitsuba.py --restir target/release/restir --out docs/mitsuba.md"
        f" --spp {arguments.spp} --restarts {arguments.restarts} --walker {arguments.walker}`.",
        "",
        f"restir {common.commit()}, Mitsuba {mi.__version__} (`{mi.variant()}`); {SIZE[0]}x{SIZE[1]} pixels, box filter,"
        f" paths of at most {DEPTH} segments, no roulette; {arguments.restarts} independent restarts of"
        f" {arguments.spp} samples per pixel with each renderer, restir with `multiscatter=off`; {seconds:.0f} s in all. Media are Mitsuba's"
        f" `{arguments.walker}`'s, with paths as long as they go."
        " Mitsuba's other one, `volpathmis`, has fewer outliers, and with `--walker volpathmis` 0.08 % less light than restir in `media` and"
        " `rough-medium` (largest t 4.2 and 5.4), where `volpath` has as much; so has the walk in double precision of the suite `subsurface`.",
        "",
        f"Per tile of {TILE}x{TILE} pixels and channel, t is the difference of the two means over its standard error,"
        " which is estimated from the restarts. The limit holds the probability of any false alarm in all scenes together"
        f" below {FAMILY_RATE} (Bonferroni, Student's t with {arguments.restarts - 1} degrees of freedom). A bias in a tile"
        f" as large as in the column \"detectable\" would have been found with a probability of {POWER:.0%}.",
        "",
        "| scene | tests | largest abs(t) | limit | rms of t | detectable: median, worst tile | restir / Mitsuba | verdict |",
        "|---|---:|---:|---:|---:|---|---:|---|",
    ]
    for name, result in results.items():
        if isinstance(result, str):
            lines.append(f"| {name} | | | | | | | not run: {result} |")
            continue
        verdict = "agree" if result["max"] <= result["limit"] else "**differ**"
        median, worst = (f"{100 * value:.2f} %" for value in result["detectable"])
        lines.append(
            f"| {name} | {result['tests']} | {result['max']:.2f} | {result['limit']:.2f} | {result['rms']:.2f} |"
            f" {median}, {worst} | {result['ratio']:.5f} | {verdict} |"
        )
    lines += [""] + [f"* {name}: {LINES[name]}" for name in results]
    lines += ["", "Left restir, right Mitsuba, the mean of all restarts:", ""]
    lines += [f"![{name}]({r['picture']})" for name, r in results.items() if not isinstance(r, str)]
    lines += [
        "",
        "Meshes are faceted, so that no two treatments of shading normals are compared. A white metal has a Fresnel term of"
        " one in both models. Mitsuba multiplies the masking of both directions, restir correlates their heights (Heitz 2014);"
        " up to roughness 0.3 that is less than this test resolves, at 0.6 it is seen (restir is brighter by 0.2 %). The environment is one smooth function, sampled for each renderer where it places the rows of"
        " its map: Mitsuba 3 has the first and the last at the poles.",
        "",
    ]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--restir", required=True, help="the program restir")
    parser.add_argument("--out", type=Path, required=True, help="the report to write; pictures go beside it")
    parser.add_argument("--spp", type=int, default=48)
    parser.add_argument("--restarts", type=int, default=32)
    parser.add_argument("--walker", choices=["volpath", "volpathmis"], default="volpath", help="what walks through media in Mitsuba")
    parser.add_argument("--variant", default="scalar_rgb", help="Mitsuba's variant; llvm_ad_rgb is faster")
    parser.add_argument("--only", choices=SCENES, action="append", help="compare these scenes only")
    arguments = parser.parse_args()
    if arguments.restarts < 4:
        parser.error("--restarts has to be at least 4, for a standard error")
    mi.set_variant(arguments.variant)
    begin = time.monotonic()
    results = {}
    for name in arguments.only or SCENES:
        try:
            results[name] = compare(name, arguments)
        except RuntimeError as problem:
            results[name] = str(problem).splitlines()[0]
        print(name, results[name], flush=True)
    common.write_atomically(arguments.out, report(results, arguments, time.monotonic() - begin))
    failed = [n for n, r in results.items() if isinstance(r, str) or r["max"] > r["limit"]]
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
