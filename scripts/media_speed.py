#!/usr/bin/env python3
"""Measures restir's walks through media beside Mitsuba 3's `volpath`: time to equal error, collisions a second; writes a report.

    pip install 'mitsuba==3.9.*' numpy
    cargo build --release --bin restir
    python3 scripts/media_speed.py --restir target/release/restir --out docs/media-speed.md

An error is known without a reference: two images of an unbiased renderer with different seeds differ, in the mean square, by
twice its squared error. Time to equal error is the product of error and processors' seconds. Of both renderers these are the difference between renders of many and of few
samples, over the difference of samples: neither start, scene, environment nor compilation is in them. Mitsuba's variant llvm_ad_rgb takes the LLVM library that the environment
variable DRJIT_LIBLLVM_PATH names, else that of the Rust toolchain. The profile needs valgrind, and a build with line tables. `--quick` is for trying the script out.
"""

import argparse
import os
import re
import resource
import subprocess
import tempfile
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
    "half space, albedo 0.9": "40 mean free paths deep and 400 wide, behind a smooth dielectric of the index 1.33",
    "half space, albedo 0.99": "the same, but for the albedo",
    "hare, index 1.33": "the hare of `statue` behind a smooth dielectric, mean free paths 0.05, 0.03, 0.02, albedo 0.99, 0.97, 0.9",
    "three spheres": "those of docs/mitsuba.md",
}
# what is profiled: arguments of a render
PROFILED = {
    "slab": ["slab", "--size", "48x48", "--spp", "16", "--set", "max_depth=3"],
    "hare": ["statue", "--subsurface", "marble:0.02", "--size", "48x64", "--spp", "16", "--set", "max_depth=3"],
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
    if name.startswith(("slab", "half space")):
        (index, half, depth) = (1.0, 40.0, 1.0) if name.startswith("slab") else (1.33, 200.0, 40.0)
        inside = medium(index, [1.0] * 3, [float(name.split()[-1])] * 3)
        camera = {"position": [0.0, 6.0, 0.1], "target": [0.3, 0.0, 0.1], "yfov": 0.7}
        return [common.box([-half, -depth, -half], [half, 0.0, half], kind="medium", medium=inside)], camera
    if name.startswith("hare"):
        return hare(program, folder)
    objects, camera, _ = compare_mitsuba.describe("media", folder)
    return objects, camera


def restir_render(program, scene, size, spp, seed, env, folder, settings=()):
    """The image, the processors' seconds, and how many collisions there were."""
    output = folder / "restir.exr"
    command = [program, "render", scene, "-o", output, "--device", "cpu", "--jitter", "--spp", spp, "--max-depth", DEPTH]
    command += ["--size", f"{size[0]}x{size[1]}", "--seed", seed, "--env", env]
    command += [word for setting in settings for word in ("--set", setting)]
    before = processor(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    used = processor(resource.RUSAGE_CHILDREN) - before
    if "clamped" in done.stderr:
        raise RuntimeError(f"{scene} is not what was meant: {done.stderr}")
    return common.read_exr(output), used, collisions(done.stdout + done.stderr)


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


def measured(render, spp, runs):
    """Images of `render`, a function of samples and seed that gives an image, seconds and collisions, and what a render of `spp` samples takes and does: by
    what it takes beyond one of an eighth of them."""
    few = spp // 8
    all_, short = ([render(samples, seed) for seed in range(runs)] for samples in (spp, few))
    beyond = [min(run[i] for run in all_) - min(run[i] for run in short) for i in (1, 2)]
    used, steps = (number * spp / (spp - few) for number in beyond)
    images = [run[0] for run in all_]
    return images, {"used": used, "error": squared_error(images), "steps": steps}


def measure(name, program, folder, size, spp, runs, variants):
    objects, camera = describe(name, program, folder)
    env, env_mitsuba = compare_mitsuba.smooth_environment(folder, 64)
    path = folder / "scene.glb"
    common.write_glb(path, objects, camera)
    results, mean = {}, {}
    for settings in [[], ["lights_inside=off"]] if name.startswith("slab") else [[]]:
        ours = lambda samples, seed: restir_render(program, path, size, samples, seed, env, folder, settings)
        renderer = ", ".join(["restir", *settings])
        images, results[renderer] = measured(ours, spp, runs)
        mean[renderer] = np.mean(images)
    steps = results["restir"]["steps"]
    kind = "volpath" if name.startswith(("slab", "half space")) else "volpathmis"
    for variant in variants:
        renderer = f"{kind}, {variant}"
        problem = common.mitsuba_problem(variant)
        if problem:
            results[renderer] = {"problem": problem}
            continue
        mi.set_variant(variant)
        scene = mi.load_dict(common.mitsuba_scene(folder, objects, camera, size, env_mitsuba))
        integrator = common.volume_path_tracer(kind)

        def theirs(samples, seed):
            before = processor(resource.RUSAGE_SELF)
            image = common.mitsuba(scene, integrator, samples, seed)
            return image, processor(resource.RUSAGE_SELF) - before, 0.0

        # kernels are compiled for a number of samples
        theirs(spp, 1000), theirs(spp // 8, 1000)
        images, results[renderer] = measured(theirs, spp, runs)
        results[renderer]["steps"] = steps
        mean[renderer] = np.mean(images)
    mi.set_variant("scalar_rgb")
    return results, mean


def profile(program, folder, subject):
    """Instructions of a render on one thread, by part: the file of each line, inlined or not."""
    out = folder / "callgrind.out"
    render = [program, "render", *PROFILED[subject], "-o", str(folder / "p.exr"), "--threads", "1", "--device", "cpu"]
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


def asked(arguments):
    """The options that a report depends on, as they are written."""
    only = "".join(f' --only "{name}"' for name in arguments.only or [])
    only += "".join(f" --variant {variant}" for variant in arguments.variant or [])
    profiled = f" --profiled {arguments.profiled}" if arguments.profiled else ""
    return f" --runs {arguments.runs}{' --quick' if arguments.quick else ''}{only}{profiled}"


def report(rows, means, profiles, arguments, size, spp):
    lines = [
        "# Walks through media, and how fast they are",
        "",
        f"Made by `python3 scripts/media_speed.py --restir target/release/restir --out docs/media-speed.md{asked(arguments)}` at commit {common.commit()} on {common.cpu()}, Mitsuba {mi.__version__}; "
        f"{size[0]} x {size[1]} pixels, {spp} samples a pixel, {arguments.runs} seeds. restir's samples are spread and Mitsuba's "
        "independent, as each has them by default. Both walk from collision to collision and end walks by roulette from 16 collisions on; "
        "collisions are counted by restir, and Mitsuba's are taken to be as many a sample. Seconds are those of all processors together, of the fastest seed, and of both renderers the "
        f"difference between {spp} and {spp // 8} samples, extrapolated to {spp}: without start, scene and compilation. Other work on the machine changes them less than it changes "
        f"time by the clock (load {os.getloadavg()[0]:.0f} when this was written).",
        "",
        "| scene | renderer | processors' seconds | mean squared error | M collisions a processor's second | time to equal error, restir / this | restir is as fast, times | mean, restir / this |",
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
            faster, ratio, mean = ("", "", "") if renderer == "restir" else (f"{1 / ratio:.2f}", f"{ratio:.3f}", f"{means[name]['restir'] / means[name][renderer]:.4f}")
            lines.append(f"| {name} | {renderer} | {found['used']:.3f} | {found['error']:.3e} | {rate:.2f} | {ratio} | {faster} | {mean} |")
    lines += [
        "",
        *(f"* {name}: {SUBJECTS[name]}." for name in rows),
        "",
        "On the slab, whose border is index-matched, both sample lights through the border at every collision; restir does not with `lights_inside=off`. Where coefficients differ by "
        "channel Mitsuba's walk is `volpathmis`, because `volpath` takes one channel's distances for all three and has outliers.",
    ]
    spaces = [rows[name]["restir"] for name in rows if name.startswith("half space")]
    if len(spaces) == 2:
        fast, slow = spaces
        lines += [
            "",
            f"An albedo of 0.99 in place of 0.9 takes {slow['used'] / fast['used']:.2f} of the processors' time on the half space, for "
            f"{slow['steps'] / fast['steps']:.2f} times as many collisions.",
        ]
    for subject, parts in profiles.items():
        total = sum(count for _, count in parts)
        lines += [
            "",
            f"## Where the time goes: {subject}",
            "",
            f"Of the {total / 1e6:.0f} million instructions in which one thread runs `restir render {' '.join(PROFILED[subject])} -o p.exr` (`valgrind "
            f"--tool=callgrind`, by the file of each line, inlined or not), building the scene not counted, at commit {common.commit()}:",
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
    parser.add_argument("--variant", choices=VARIANTS, action="append", help="measure these of Mitsuba's variants only")
    parser.add_argument("--only", choices=list(SUBJECTS), action="append", help="measure these scenes only")
    arguments = parser.parse_args()
    size, spp = ([32, 32], 16) if arguments.quick else ([128, 128], 64)
    rows, means = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.only or SUBJECTS:
            place = Path(folder) / name.replace(" ", "-").replace(",", "")
            place.mkdir()
            rows[name], means[name] = measure(name, arguments.restir, place, size, spp, arguments.runs, arguments.variant or VARIANTS)
            print(name, rows[name], flush=True)
        subjects = PROFILED if arguments.profiled else []
        profiles = {subject: profile(arguments.profiled, Path(folder), subject) for subject in subjects}
    common.write_atomically(arguments.out, report(rows, means, profiles, arguments, size, spp))


if __name__ == "__main__":
    main()
