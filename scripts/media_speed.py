#!/usr/bin/env python3
"""Measures restir's walks through media beside Mitsuba 3's `volpath`: time to equal error, collisions a second; writes a report.

    pip install 'mitsuba==3.9.*' numpy
    cargo build --release --bin restir
    python3 scripts/media_speed.py --restir target/release/restir --out docs/media-speed.md

An error is known without a reference: two images of an unbiased renderer with different seeds differ, in the mean square, by
twice its squared error. Time to equal error is the product of error and processors' seconds. Mitsuba's seconds are those of a render until the image is there, after one that compiled its kernels;
restir's are what the program reports for rendering. Mitsuba's variant llvm_ad_rgb takes the LLVM library that the environment
variable DRJIT_LIBLLVM_PATH names, else that of the Rust toolchain. The profile needs valgrind. `--quick` is for trying the script out.
"""

import argparse
import os
import re
import resource
import subprocess
import tempfile
import time
from pathlib import Path

# before Mitsuba, because it says which LLVM that takes
import compare_mitsuba
import mitsuba_common as common
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

DEPTH = 64
VARIANTS = ["scalar_rgb", "llvm_ad_rgb"]
SUBJECTS = {
    "slab, albedo 0.9": "one mean free path thick, index-matched, under the environment",
    "slab, albedo 0.99": "the same, but for the albedo",
    "hare, index 1.33": "the hare of `statue` behind a smooth dielectric, mean free paths 0.05, 0.03, 0.02, albedo 0.99, 0.97, 0.9",
    "three spheres": "those of docs/mitsuba.md",
}


# files, and what they are part of; what is not named builds scenes, or writes files
PARTS = [
    (r"shared/src/(geometry|scene/(view|coverage))|wide_bvh|obvhs/src/ray", "traversal"),
    (r"shared/src/num", "divisions, roots and functions"),
    (r"shared/src/rng", "random numbers"),
    (r"shared/src/(technique/path/media|medium|sampling/(henyey|exponential))", "the walk: distances, turns, roulette"),
    (r"shared/src/(bsdf|transport)", "scattering at surfaces, connections"),
    (r"shared/src/(scene|sampling|pack|vec|color)", "surfaces, lights and vectors"),
    (r"shared/src/(film|camera|technique)|kernels/src|host/src/exec", "the rest of the kernel"),
]


def medium(index, extinction, albedo, anisotropy=0.0):
    return {"index": index, "extinction": extinction, "albedo": albedo, "anisotropy": anisotropy}


def box(half, depth, **material):
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-depth, 0) for z in (-half, half)], dtype=np.float64)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return common.Object(corners, [t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])], **material)


def hare(program, folder):
    """The objects of `statue`, in which the hare, the largest mesh, is of a medium."""
    objects, camera, _, _ = common.plain_scene(program, "statue", folder / "statue")
    largest = max(objects, key=lambda part: len(part.triangles))
    inside = medium(1.33, [20.0, 33.0, 50.0], [0.99, 0.97, 0.9])
    largest.material = {"kind": "medium", "medium": inside}
    for part in objects:
        if part is not largest:
            part.uvs, part.material = None, {"kind": "diffuse", "color": (0.5, 0.5, 0.5)}
    return objects, camera


def describe(name, program, folder):
    if name.startswith("slab"):
        albedo = [float(name.split()[-1])] * 3
        camera = {"position": [0.0, 6.0, 0.1], "target": [0.3, 0.0, 0.1], "yfov": 0.7}
        return [box(40.0, 1.0, kind="medium", medium=medium(1.0, [1.0] * 3, albedo))], camera
    if name.startswith("hare"):
        return hare(program, folder)
    objects, camera, _ = compare_mitsuba.describe("media", folder)
    return objects, camera


def restir_render(program, scene, size, spp, seed, env, folder, settings=()):
    """The image, the seconds, and how many collisions there were."""
    output = folder / "restir.exr"
    command = [program, "render", scene, "-o", output, "--device", "cpu", "--jitter", "--spp", spp, "--max-depth", DEPTH]
    command += ["--size", f"{size[0]}x{size[1]}", "--seed", seed, "--env", env]
    command += [word for setting in settings for word in ("--set", setting)]
    before = processor(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    used = processor(resource.RUSAGE_CHILDREN) - before
    if "clamped" in done.stderr:
        raise RuntimeError(f"{scene} is not what was meant: {done.stderr}")
    seconds = size[0] * size[1] * spp / float(re.search(r"\(([0-9.e+]+) samples/s\)", done.stdout).group(1))
    return common.read_exr(output), seconds, collisions(done.stdout + done.stderr), used


def processor(who):
    """Seconds of all processors so far."""
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def collisions(text):
    found = re.search(r"^scatterings: (\d+)", text, re.M)
    return float(found.group(1)) if found else 0.0


def squared_error(images):
    """Of one image, from several with different seeds."""
    return float(np.mean(np.var(images, axis=0, ddof=1)))


def measure(name, program, folder, size, spp, runs):
    objects, camera = describe(name, program, folder)
    env, env_mitsuba = compare_mitsuba.smooth_environment(folder)
    path = folder / "scene.glb"
    common.write_glb(path, objects, camera)
    results, mean = {}, {}
    for settings in [[], ["lights_inside=off"]] if name.startswith("slab") else [[]]:
        ours = [restir_render(program, path, size, spp, seed, env, folder, settings) for seed in range(runs)]
        seconds, steps, used = (min(run[i] for run in ours) for i in (1, 2, 3))
        renderer = ", ".join(["restir", *settings])
        results[renderer] = {"seconds": seconds, "used": used, "error": squared_error([run[0] for run in ours]), "steps": steps}
        mean[renderer] = np.mean([run[0] for run in ours])
    for variant in VARIANTS:
        problem = common.mitsuba_problem(variant)
        if problem:
            results[variant] = {"problem": problem}
            continue
        mi.set_variant(variant)
        scene = mi.load_dict(common.mitsuba_scene(folder, objects, camera, size, env_mitsuba))
        integrator = common.volume_path_tracer()
        common.mitsuba(scene, integrator, spp, 1000)
        images, times, used = [], [], []
        for seed in range(runs):
            begin, before = time.perf_counter(), processor(resource.RUSAGE_SELF)
            images.append(common.mitsuba(scene, integrator, spp, seed))
            times.append(time.perf_counter() - begin)
            used.append(processor(resource.RUSAGE_SELF) - before)
        mean[variant] = np.mean(images)
        results[variant] = {"seconds": min(times), "used": min(used), "error": squared_error(images), "steps": steps}
    mi.set_variant("scalar_rgb")
    return results, mean


def profile(program, folder):
    """Instructions of a render of `candles` on one thread, by part: the file of each line, inlined or not."""
    out = folder / "callgrind.out"
    render = [program, "render", "candles", "-o", str(folder / "p.exr"), "--size", "64x48", "--spp", "8", "--threads", "1"]
    render += ["--set", "max_depth=6"]
    valgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}"]
    subprocess.run([*valgrind, *render], capture_output=True, check=True)
    names, costs, file, skip = {}, {}, "", False
    for line in out.read_text().splitlines():
        if match := re.match(r"(?:fl|fi|fe)=\((\d+)\)(?: (.*))?", line):
            file = names.setdefault(match[1], match[2])
        elif match := re.match(r"c?f[il]=\((\d+)\) (.*)", line) or re.match(r"cfl=\((\d+)\) (.*)", line):
            names.setdefault(match[1], match[2])
        elif line.startswith("calls="):
            skip = True
        elif match := re.match(r"[+\-*\d]\S* (\d+)$", line):
            part = next((part for pattern, part in PARTS if re.search(pattern, file or "")), None)
            if not skip and part:
                costs[part] = costs.get(part, 0) + int(match[1])
            skip = False
    return sorted(costs.items(), key=lambda item: -item[1])


def report(rows, means, parts, arguments, size, spp):
    lines = [
        "# Walks through media, and how fast they are",
        "",
        f"Made by `python3 scripts/media_speed.py` at commit {common.commit()} on {common.cpu()}, Mitsuba {mi.__version__}; "
        f"{size[0]} x {size[1]} pixels, {spp} samples a pixel, {arguments.runs} seeds, of which the fastest's time is told, all threads. restir's samples are spread and Mitsuba's "
        "independent, as each has them by default. Both walk from collision to collision and end walks by roulette from 16 collisions on; "
        "collisions are counted by restir, and Mitsuba's are taken to be as many a sample. Time to equal error is by the processors' seconds, "
        f"which other work on the machine (load {os.getloadavg()[0]:.0f} when this was written) changes less; restir's hold the reading of the scene.",
        "",
        "| scene | renderer | seconds | of processors | mean squared error | M collisions a processor's second | time to equal error, restir / this | mean, restir / this |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name, results in rows.items():
        own = results["restir"]
        for renderer, found in results.items():
            if "problem" in found:
                lines.append(f"| {name} | {renderer} | did not run: {found['problem']} | | | | | |")
                continue
            rate = found["steps"] / found["used"] / 1e6
            ratio = own["used"] * own["error"] / (found["used"] * found["error"])
            ratio, mean = ("", "") if renderer == "restir" else (f"{ratio:.3f}", f"{means[name]['restir'] / means[name][renderer]:.4f}")
            lines.append(f"| {name} | {renderer} | {found['seconds']:.3f} | {found['used']:.3f} | {found['error']:.3e} | {rate:.2f} | {ratio} | {mean} |")
    slow, fast = rows["slab, albedo 0.99"]["restir"], rows["slab, albedo 0.9"]["restir"]
    lines += [
        "",
        *(f"* {name}: {what}." for name, what in SUBJECTS.items()),
        "",
        "On the slabs, whose border is index-matched, both sample lights through the border at every collision; restir does not with `lights_inside=off`. Where images have outliers, errors and "
        "means are as uncertain as these: of the hare's coefficients Mitsuba's `volpath` takes one channel's distances for all three. Its `volpathmis`, which "
        "does not, has the same mean there.",
        "",
        f"An albedo of 0.99 in place of 0.9 takes {slow['used'] / fast['used']:.2f} of the processors' time on the slab, for "
        f"{slow['steps'] / fast['steps']:.2f} times as many collisions.",
    ]
    if parts:
        total = sum(count for _, count in parts)
        lines += [
            "",
            "## Where the time goes",
            "",
            f"Of the {total / 1e6:.0f} million instructions in which one thread renders `candles`, 64 x 48 pixels, 8 samples (`valgrind "
            "--tool=callgrind`, by the file of each line, inlined or not), building the scene not counted:",
            "",
            "| part | share |",
            "|---|---:|",
            *(f"| {part} | {100 * count / total:.1f} % |" for part, count in parts),
        ]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--restir", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--profiled", help="a build with line tables (CARGO_PROFILE_RELEASE_DEBUG=line-tables-only), for the profile")
    parser.add_argument("--runs", type=int, default=6)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    size, spp = ([32, 32], 16) if arguments.quick else ([128, 128], 64)
    rows, means = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name in SUBJECTS:
            place = Path(folder) / name.replace(" ", "-").replace(",", "")
            place.mkdir()
            rows[name], means[name] = measure(name, arguments.restir, place, size, spp, arguments.runs)
            print(name, rows[name], flush=True)
        parts = profile(arguments.profiled, Path(folder)) if arguments.profiled else []
    common.write_atomically(arguments.out, report(rows, means, parts, arguments, size, spp))


if __name__ == "__main__":
    main()
