#!/usr/bin/env python3
"""Times restir against Mitsuba 3 on Mitsuba's Cornell box, and writes a report.

    pip install 'mitsuba==3.9.*' numpy
    cargo build --release --bin restir
    python3 scripts/time_mitsuba.py --restir target/release/restir --out docs/mitsuba-speed.md

Mitsuba's variant llvm_ad_rgb takes the LLVM library that the environment variable DRJIT_LIBLLVM_PATH names, else that of the
Rust toolchain. On processors with AVX-512, LLVM 15 and 19 abort on an instruction that they cannot select; 22 works.

The renderers run in turns, after a warm-up each. Mitsuba's time is that of `mi.render` until the image is there, restir's
is what the program reports for rendering; neither includes loading the scene and building its tree.
"""

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

# before Mitsuba, because it says which LLVM that takes
import mitsuba_common as common
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

DEPTH = 8
VARIANTS = ["scalar_rgb", "llvm_ad_rgb"]


def mitsuba_runner(variant, size, spp):
    mi.set_variant(variant)
    scene = mi.load_dict(common.mitsuba_cornell_box(size))
    integrator = common.path_tracer(DEPTH)

    def run(seed):
        mi.set_variant(variant)
        begin = time.perf_counter()
        image = common.mitsuba(scene, integrator, spp, seed)
        return image, time.perf_counter() - begin

    return run


def restir_runner(program, size, spp, folder):
    output = Path(folder) / "restir.exr"
    # as Mitsuba's sampler in these scenes
    independent = ["sampler=independent"]
    return lambda seed: common.restir(program, "cornell-mitsuba", size, spp, DEPTH, seed, output, settings=independent)


def squared_error(first, second):
    """Mean squared error of an unbiased renderer's image, from two with different seeds."""
    return float(np.mean((first - second) ** 2) / 2)


def measure(runners, runs):
    """Seconds of each run, and the images of the first two, in turns; the warm-up is not counted."""
    seconds, images = ({name: [] for name in runners} for _ in range(2))
    for seed in range(runs + 1):
        for name, run in runners.items():
            image, duration = run(seed)
            if seed > 0:
                seconds[name].append(duration)
            if seed in (1, 2):
                images[name].append(image)
    return seconds, images


def report(seconds, images, missing, arguments):
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    errors = {name: squared_error(*pair) for name, pair in images.items()}
    side, spp = arguments.size, arguments.spp
    lines = [
        "# Speed beside Mitsuba 3",
        "",
        f"Written by `python3 scripts/time_mitsuba.py --restir target/release/restir --out docs/mitsuba-speed.md"
        f" --runs {arguments.runs}`.",
        "",
        f"restir {common.commit()}, Mitsuba {mi.__version__}; {common.cpu()}, load average at the end"
        f" {os.getloadavg()[0]:.1f}. `mi.cornell_box()`, {side}x{side} pixels, {spp} samples per pixel, paths of at most"
        f" {DEPTH} segments, no roulette, all cores; median of {arguments.runs} runs in turns after a warm-up.",
        "",
        "| renderer | median | fastest, slowest | RMSE | speed of restir | restir's time to equal RMSE |",
        "|---|---:|---|---:|---:|---:|",
    ]
    for name, median in medians.items():
        # the error of an unbiased renderer falls with the root of its samples, and so of its time
        equal = medians["restir"] * errors["restir"] / errors[name]
        lines.append(
            f"| {name} | {median:.2f} s | {min(seconds[name]):.2f} s, {max(seconds[name]):.2f} s | {errors[name] ** 0.5:.4f} |"
            f" {median / medians['restir']:.2f}x | {equal:.2f} s ({median / equal:.2f}x) |"
        )
    lines += [f"| {name} | not run: {reason} | | | | |" for name, reason in missing.items()]
    lines += [
        "",
        "RMSE is that of one image, from the difference of two with different seeds, which needs no reference; that both"
        " renderers converge to the same image is shown by [mitsuba.md](mitsuba.md).",
        "",
    ]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--restir", required=True, help="the program restir")
    parser.add_argument("--out", type=Path, required=True, help="the report to write")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--spp", type=int, default=64)
    arguments = parser.parse_args()
    if arguments.runs < 2:
        parser.error("--runs has to be at least 2")
    size = [arguments.size, arguments.size]
    missing = {}
    with tempfile.TemporaryDirectory() as folder:
        runners = {"restir": restir_runner(arguments.restir, size, arguments.spp, folder)}
        for variant in VARIANTS:
            if problem := common.mitsuba_problem(variant):
                missing[variant] = problem
            else:
                runners[variant] = mitsuba_runner(variant, size, arguments.spp)
        seconds, images = measure(runners, arguments.runs)
    common.write_atomically(arguments.out, report(seconds, images, missing, arguments))
    for name, values in seconds.items():
        print(name, *(f"{value:.2f}" for value in values))


if __name__ == "__main__":
    main()
