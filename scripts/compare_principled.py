#!/usr/bin/env python3
"""Shows the same glTF materials by restir and by Mitsuba 3's `principled`, side by side, and writes a report.

The two models differ on purpose, so nothing is tested here: `compare_mitsuba.py` tests what both share."""

import argparse
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
import mitsuba_common as common
from compare_mitsuba import smooth_environment

SIZE = (72, 72)
DEPTH = 8
ROUGHNESSES = [0.1, 0.3, 0.6, 1.0]
MATERIALS = {
    "white plastic": {"color": (0.8, 0.8, 0.8)},
    "red plastic": {"color": (0.55, 0.1, 0.08)},
    "white metal": {"color": (1.0, 1.0, 1.0), "metallic": 1.0},
    "gold": {"color": (1.0, 0.77, 0.34), "metallic": 1.0},
}
CAMERA = {"position": [0.0, 0.0, 5.0], "target": [0.0, 0.0, 0.0], "yfov": 0.42}


def inside():
    """The pixels of the sphere of radius 1."""
    half = np.tan(CAMERA["yfov"] / 2)
    x = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1
    radius = np.tan(np.arcsin(1 / CAMERA["position"][2])) / half
    return x[None, :] ** 2 + x[:, None] ** 2 < (0.97 * radius) ** 2


def pictures(arguments, folder, env, material):
    """By restir, by restir with single scattering, by Mitsuba."""
    objects = [common.sphere([0, 0, 0], 1.0, kind="principled", **material)]
    path = folder / "scene.glb"
    common.write_glb(path, objects, CAMERA)
    ours = [
        common.restir(arguments.restir, path, SIZE, arguments.spp, DEPTH, 1, folder / "o.exr", env[0], settings)[0]
        for settings in ([], ["multiscatter=off"])
    ]
    scene = mi.load_dict(common.mitsuba_scene(folder, objects, CAMERA, SIZE, env[1]))
    return [*ours, common.mitsuba(scene, common.path_tracer(DEPTH), arguments.spp, 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--restir", required=True, help="the program restir")
    parser.add_argument("--out", type=Path, required=True, help="the report to write; the picture goes beside it")
    parser.add_argument("--spp", type=int, default=256)
    arguments = parser.parse_args()
    mask, rows, lines = inside(), [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        env = smooth_environment(folder)
        for name, material in MATERIALS.items():
            row = []
            for roughness in ROUGHNESSES:
                images = pictures(arguments, folder, env, material | {"roughness": roughness})
                ours, single, theirs = (image[mask].mean() for image in images)
                lines.append(f"| {name} | {roughness} | {ours / theirs:.3f} | {single / theirs:.3f} |")
                row.append(np.concatenate(images, axis=0))
            rows.append(np.concatenate(row, axis=1))
    picture = arguments.out.with_suffix(".png")
    common.write_png(picture, np.concatenate([np.concatenate(rows[:2], axis=1), np.concatenate(rows[2:], axis=1)], axis=0))
    common.write_atomically(arguments.out, report(arguments, picture, lines))


def report(arguments, picture, lines):
    head = [
        "# The same materials by restir and by Mitsuba's `principled`",
        "",
        "Written by `python3 scripts/compare_principled.py --restir target/release/restir --out docs/principled.md"
        f" --spp {arguments.spp}`.",
        "",
        f"restir {common.commit()}, Mitsuba {mi.__version__}. Spheres of white and red plastic (base colours .8 and .55, .1, .08;"
        " index 1.5), below them of white metal and gold, of roughness 0.1, 0.3, 0.6 and 1, under a smooth environment. Of"
        " each material the upper row is restir's, the second restir's with `multiscatter=off`, the third Mitsuba's.",
        "",
        f"![spheres]({picture.name})",
        "",
        "The mean radiance of the sphere over Mitsuba's, in one render by each:",
        "",
        "| material | roughness | restir | restir, `multiscatter=off` |",
        "|---|---:|---:|---:|",
    ]
    why = [
        "",
        "Why they differ:",
        "",
        "* **Rough metal** (restir brighter): `principled` scatters once, as restir does with `multiscatter=off`; the two differ by"
        " the masking then, which `principled` takes as the product of both directions' and restir by correlated heights, which"
        " masks less.",
        "* **Plastic**: `principled` takes Burley's diffuse lobe, which is not darkened by what the coat reflects and brightens"
        " towards grazing angles with the roughness; restir's diffuse part has what the coat lets through. With `multiscatter=off`"
        " restir loses what its coat reflects twice and returns nothing of it.",
        "* **Gold** is tinted more by restir where it is rough: light that was reflected twice has the colour twice.",
        "",
    ]
    return "\n".join(head + lines + why)


if __name__ == "__main__":
    main()
