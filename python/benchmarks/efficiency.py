"""How much faster two workers are than one, and what that says of a thousand.

    python python/benchmarks/efficiency.py --write docs/farm-efficiency.md

Each worker has one thread, so that two of them have the machine's first two cores. Times are medians of several renders, in turns.
"""

import argparse
import logging
import os
import statistics
import tempfile
import time
from pathlib import Path

import dask
import restir
import restir.distributed
from distributed import Client, LocalCluster

SCENE, SIZE, SAMPLES, PART = "glass", (256, 192), 256, 8
# an image of film size, of one sample a part: merging is all that counts
FILM, FILM_PARTS = (2048, 1080), 16
PLANES = 1  # parts of a power of two of samples are a single plane
PIXEL = 16
REPEATS = 5


def seconds(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def clusters():
    """A client of one worker, and one of two."""
    with dask.config.set({"distributed.logging.distributed": "critical"}):
        options = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
        return [Client(LocalCluster(n_workers=count, **options)) for count in (1, 2)]


def rendering() -> tuple[float, float, float]:
    """Seconds of one worker and of two for the same picture, and of a part beside its rendering."""
    one, two = clusters()
    for client, count in ((one, 1), (two, 2)):
        client.wait_for_workers(count)
        restir.distributed.render(client, SCENE, samples=2, part=1, size=SIZE)
    render = lambda client: restir.distributed.render(client, SCENE, samples=SAMPLES, part=PART, size=SIZE)
    times = [[seconds(lambda client=client: render(client)) for client in (one, two)] for _ in range(REPEATS)]
    tiny = lambda: restir.distributed.render(one, SCENE, samples=200, part=1, size=(8, 6))
    overhead = statistics.median(seconds(tiny) / 200 for _ in range(3))
    for client in (one, two):
        client.cluster.close()
        client.close()
    return *(statistics.median(column) for column in zip(*times, strict=True)), overhead


def merging() -> float:
    """Seconds to check and merge a byte of parts."""
    scene = restir.load("cornell")
    with tempfile.TemporaryDirectory() as folder:
        parts = [Path(folder) / f"{index}.part" for index in range(FILM_PARTS)]
        for index, part in enumerate(parts):
            restir.render_part(part, scene, samples=range(index, index + 1), size=FILM, max_depth=1)
        size = sum(part.stat().st_size for part in parts)
        return statistics.median(seconds(lambda: restir.merge(parts)) for _ in range(REPEATS)) / size


def report() -> str:
    one, two, overhead = rendering()
    byte = merging()
    moved = FILM[0] * FILM[1] * PIXEL * PLANES
    rows = [(workers, 8 * workers) for workers in (10, 100, 1000)]
    table = "".join(
        f"| {workers} | {parts} | {parts * moved / 1e9:.1f} GB | {parts * overhead:.1f} s | {parts * moved * byte:.0f} s |\n"
        for workers, parts in rows
    )
    cores = os.cpu_count()
    return f"""# Two workers, and a model of a thousand

Two workers are {one / two:.2f} times as fast as one, an efficiency of {one / two / 2:.0%}, on a machine of {cores} cores, which the scheduler and the merging share.

`python python/benchmarks/efficiency.py --write docs/farm-efficiency.md` (3 min) measured this: `{SCENE}`, {SIZE[0]} x {SIZE[1]} pixels,
{SAMPLES} samples in parts of {PART}; medians of {REPEATS} renders, in turns; one thread a worker.

| | |
|---|---:|
| one worker | {one:.2f} s |
| two workers | {two:.2f} s |
| overhead of a part (8 x 6 pixels, one sample): task, file, transfer | {1000 * overhead:.1f} ms |
| checking and merging | {1e9 * byte:.2f} s a GB of parts, on one core |

**The model.** A part of 2^k samples is one plane of {PIXEL} bytes a pixel, whatever k is: {moved / 1e6:.0f} MB of {FILM[0]} x {FILM[1]} pixels. The table
has the costs that do not shrink with more workers, at eight parts a worker. A render of T seconds of work takes about T / workers. The last two columns mostly overlap with it, if they are shorter; else they
decide. So parts should be few and long: with one part a worker the columns are an eighth. The model has no network: divide the bytes by its speed.

| workers | parts | bytes moved | tasks, one after another | merging |
|---:|---:|---:|---:|---:|
{table}"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="the report to write; it is printed if there is none")
    asked = parser.parse_args()
    os.environ["RAYON_NUM_THREADS"] = "1"
    text = report()
    if asked.write is None:
        print(text)
    else:
        asked.write.write_text(text)
