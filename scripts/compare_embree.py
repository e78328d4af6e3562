#!/usr/bin/env python3
"""Compares queries and their speed with Embree's for single rays (rtcIntersect1, rtcOccluded1), one thread each.

    pip install embreex==4.4 numpy
    python3 scripts/compare_embree.py assets/dragon_res2.glb many-lights

The example `trace_rays` of restir-host makes the rays and traces them; both sides get the same triangles and the same
rays, their runs alternate, and neither time includes the building of the hierarchy. `embreex` calls Embree for each ray
of a batch, in a compiled loop.

"median" is over whole runs. "undisturbed" adds up the shortest time of each chunk of 8192 rays over all runs, which
leaves out what other processes took.
"""

import argparse
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

CHUNK = 1 << 13
NONE = 0xFFFFFFFF


def processor():
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    fields = dict(line.split("\t: ", 1) for line in lines if "\t: " in line)
    names = ["model name\t", "model name", "cpu family", "cpu family\t", "model\t", "model\t\t"]
    return ", ".join(f"{name.strip()} {fields[name]}" for name in names if name in fields)


class Restir:
    """The example as a server: a line with the name of a set makes it trace."""

    def __init__(self, scene, folder):
        build = ["cargo", "build", "--quiet", "--release", "--locked", "--example", "trace_rays"]
        subprocess.run(build, check=True)
        command = ["cargo", "run", "--quiet", "--release", "--locked", "--example", "trace_rays", "--"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command + [scene, folder], stdin=pipe, stdout=pipe, text=True)
        self.sets = [word.split(":") for word in self.answer()]

    def answer(self):
        return self.process.stdout.readline().split()

    def trace(self, name):
        self.process.stdin.write(name + "\n")
        self.process.stdin.flush()
        return np.array(self.answer(), float)


class Rays:
    """A set of rays as Embree takes them."""

    def __init__(self, path, query):
        words = np.fromfile(path, np.float32).reshape(-1, 7)
        parts = words[:, :3], words[:, 3:6], words[:, 6]
        self.arrays = [np.ascontiguousarray(part) for part in parts]
        self.occluded = query == "Occluded"

    def __len__(self):
        return len(self.arrays[0])

    def ask(self, scene, rays, output=None):
        """Of the rays of a slice whether anything is hit, or with `output` what."""
        query = "OCCLUDED" if self.occluded else "INTERSECT"
        origins, directions, lengths = (array[rays] for array in self.arrays)
        # which Embree overwrites
        return scene.run(origins, directions, lengths.copy(), query, output)

    def trace(self, scene):
        """Seconds for each chunk, like the example's."""
        seconds = []
        for first in range(0, len(self), CHUNK):
            start = time.perf_counter()
            self.ask(scene, slice(first, first + CHUNK))
            seconds.append(time.perf_counter() - start)
        return np.array(seconds)


def differences(t, ids, embree):
    """Rays of which one side sees a hit, another triangle, or another distance."""
    their_t, their_ids = embree["tfar"], embree["primID"].astype(np.uint32)
    hit, their_hit = ids != NONE, their_ids != NONE
    both = hit & their_hit
    relative = np.abs(t[both] - their_t[both]) / t[both]
    other = np.count_nonzero(ids[both] != their_ids[both])
    return [np.count_nonzero(hit != their_hit), other, np.count_nonzero(relative > 1e-5)]


def compare(rays, answers, scene):
    """How often both sides differ, and the share of rays that hit."""
    t, ids = answers["t"], answers["id"]
    everything = slice(0, len(rays))
    if rays.occluded:
        found = [np.count_nonzero((ids == NONE) != (rays.ask(scene, everything) < 0)), "", ""]
    else:
        found = differences(t, ids, rays.ask(scene, everything, output=True))
    return [f"{np.mean(ids != NONE):.3f}", *found]


def report(name, count, ours, theirs, columns):
    """Two lines of the table."""
    medians = [statistics.median(run.sum() for run in runs) for runs in (ours, theirs)]
    undisturbed = [np.min(runs, axis=0).sum() for runs in (ours, theirs)]
    for kind, seconds in [("median", medians), ("undisturbed", undisturbed)]:
        speed, their_speed = (count / s * 1e-6 for s in seconds)
        cells = [f"{name}, {kind}", f"{speed:.2f}", f"{their_speed:.2f}", f"{speed / their_speed:.2f}", *columns]
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


def measure(name, runs):
    """The table of a scene."""
    with tempfile.TemporaryDirectory() as folder:
        restir = Restir(name, folder)
        path = pathlib.Path(folder)
        triangles = np.fromfile(path / "triangles.f32", np.float32).reshape(-1, 3)
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, triangles, np.arange(len(triangles), dtype=np.int32).reshape(-1, 3))
        print(f"\n{name}: {len(triangles) // 3} triangles; {processor()}; medians of {runs} runs\n")
        print("| rays | ours, Mrays/s | Embree | ratio | hit | only one hits | other triangle | t differs by > 1e-5 |")
        print("|---|---|---|---|---|---|---|---|")
        for kind, query in restir.sets:
            rays = Rays(path / f"{kind}.f32", query)
            # builds the hierarchy the first time
            rays.ask(scene, slice(0, 1))
            ours, theirs = [], []
            for _ in range(runs):
                ours.append(restir.trace(kind))
                theirs.append(rays.trace(scene))
            answers = np.fromfile(path / f"{kind}.answers", np.dtype([("t", "<f4"), ("id", "<u4")]))
            report(kind, len(rays), ours, theirs, compare(rays, answers, scene))
        restir.process.stdin.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", help="scenes as `restir render` takes them")
    parser.add_argument("--runs", type=int, default=7)
    options = parser.parse_args()
    for name in options.scenes:
        measure(name, options.runs)


if __name__ == "__main__":
    main()
