#!/usr/bin/env python3
"""Compares closest hits and their speed with Embree's single-ray query (rtcIntersect1), one thread each.

    pip install embreex==4.4 numpy
    python3 scripts/compare_embree.py ../shared/data/dragon_res2.glb

The example `trace_rays` of restir-host makes the rays and traces them; both sides get the same triangles and the same
rays, their runs alternate, and neither time includes the building of the hierarchy. `embreex` calls rtcIntersect1 for
each ray of a batch, in a compiled loop.
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

SETS = ["chords", "primary"]
NONE = 0xFFFFFFFF


def processor():
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    fields = dict(line.split("\t: ", 1) for line in lines if "\t: " in line)
    names = ["model name\t", "model name", "cpu family", "cpu family\t", "model\t", "model\t\t"]
    return ", ".join(f"{name.strip()} {fields[name]}" for name in names if name in fields)


class Restir:
    """The example as a server: a line with the name of a set makes it trace."""

    def __init__(self, scene, folder):
        build = ["cargo", "build", "--quiet", "--release", "-p", "restir-host", "--example", "trace_rays"]
        subprocess.run(build, check=True)
        command = ["cargo", "run", "--quiet", "--release", "-p", "restir-host", "--example", "trace_rays", "--"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command + [scene, folder], stdin=pipe, stdout=pipe, text=True)
        assert self.answer() == "ready"

    def answer(self):
        return self.process.stdout.readline().strip()

    def trace(self, name):
        self.process.stdin.write(name + "\n")
        self.process.stdin.flush()
        return float(self.answer())


def report(name, rays, ours, theirs, hits, embree):
    """A line of the table: rays of which one side sees a hit, another triangle, or another distance."""
    t, ids = hits["t"], hits["id"]
    their_t, their_ids = embree["tfar"], embree["primID"].astype(np.uint32)
    hit, their_hit = ids != NONE, their_ids != NONE
    both = hit & their_hit
    relative = np.abs(t[both] - their_t[both]) / t[both]
    other = np.count_nonzero(ids[both] != their_ids[both])
    speed, their_speed = (len(rays) / statistics.median(s) * 1e-6 for s in (ours, theirs))
    print(
        f"| {name} | {speed:.2f} | {their_speed:.2f} | {speed / their_speed:.2f} | {hit.mean():.3f} "
        f"| {np.count_nonzero(hit != their_hit)} | {other} | {np.count_nonzero(relative > 1e-5)} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="a scene as `restir render` takes it")
    parser.add_argument("--runs", type=int, default=7)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        restir = Restir(options.scene, folder)
        path = pathlib.Path(folder)
        triangles = np.fromfile(path / "triangles.f32", np.float32).reshape(-1, 3)
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, triangles, np.arange(len(triangles), dtype=np.int32).reshape(-1, 3))
        print(f"{options.scene}: {len(triangles) // 3} triangles; {processor()}; medians of {options.runs} runs\n")
        print("| rays | ours, Mrays/s | Embree | ratio | hit | only one hits | other triangle | t differs by > 1e-5 |")
        print("|---|---|---|---|---|---|---|---|")
        for name in SETS:
            rays = np.fromfile(path / f"{name}.f32", np.float32).reshape(-1, 6)
            origins, directions = np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:])
            embree = scene.run(origins, directions, output=True)
            ours, theirs = [], []
            for _ in range(options.runs):
                ours.append(restir.trace(name))
                start = time.perf_counter()
                scene.run(origins, directions)
                theirs.append(time.perf_counter() - start)
            hits = np.fromfile(path / f"{name}.hits", np.dtype([("t", "<f4"), ("id", "<u4")]))
            report(name, rays, ours, theirs, hits, embree)
        restir.process.stdin.close()


if __name__ == "__main__":
    main()
