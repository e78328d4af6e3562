#!/usr/bin/env python3
"""Measures restir's time to equal error beside Mitsuba 3, and what its spread samples are worth; writes a report.

    pip install 'mitsuba==3.9.*' numpy
    cargo build --release --bin restir
    python3 scripts/speed.py --restir target/release/restir --out docs/speed.md

Meshes and the environment map come from `--data`. Mitsuba's variant llvm_ad_rgb takes the LLVM library that the environment
variable DRJIT_LIBLLVM_PATH names, else that of the Rust toolchain. Nothing else should run meanwhile; `--quick` is for trying
the script out, and `--only dragon` compares on the scenes with that in their names and writes no report. Mitsuba's process is slower
before it has rendered another scene, so that only what a report says counts.

An error is known without a reference: two images of an unbiased renderer with different seeds differ, in the mean square, by
twice its squared error. Mitsuba's seconds are those of a render until the image is there, after one that compiled its kernels;
restir's are what the program reports for rendering.
"""

import argparse
import functools
import os
import statistics
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Callable, NamedTuple

# before Mitsuba, because it says which LLVM that takes
import mitsuba_common as common
import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

DEPTH = 8
SPP = 64
VARIANTS = ["scalar_rgb", "llvm_ad_rgb"]
SAMPLERS = ["independent", "stratified", "multijitter", "ldsampler", "orthogonal"]
RESERVOIRS = [
    "preset=progressive",
    "preset=progressive,candidates=128",
    "preset=progressive,candidates=256",
    "preset=progressive,candidates=128,spatial=1,shaded=16,shading_radius=3",
    "preset=offline",
    "preset=quality",
]
METRICS = ["RMSE", "relMSE"]
REL_MSE_EPSILON = 1e-3  # as `restir compare` has it
MOST_SAMPLES = 4096
FRAMES = SPP // 16  # of ReSTIR DI
SEEN_RAYS = 256  # of a frame of ReSTIR DI, for what is seen directly over the area of pixels
FINALISTS = {"RMSE": 2, "relMSE": 1}  # Mitsuba's samplers that are measured, since the trial is noisy
TRIES = 3  # runs of what only chooses
OWN_TRIES = 8  # which also show that the pictures are the same
MARGIN = 1.05  # of error, by which a power law may go beyond what was measured
LOAD_LIMIT = 2.5
# One lets restir's and Mitsuba's ray offsets, of which the latter has a least length, be small beside the mesh.
DRAGON_SCALE = 100.0
DRAGON = {"kind": "diffuse", "color": (0.7, 0.7, 0.7)}
FALSE_ALARM_OF_THREE_SIGMA = 1.35e-3
FAMILY_RATE = 1e-3


class Effort(NamedTuple):
    """How much is measured: the whole, or enough to see that the script works."""

    scale: float  # of the sides of images
    runs: int
    own_runs: int
    slope_seeds: int
    slope_powers: range
    scene_seeds: int
    powers: range


FULL = Effort(scale=1.0, runs=5, own_runs=8, slope_seeds=4, slope_powers=range(4, 13), scene_seeds=16, powers=range(9))
QUICK = Effort(scale=0.25, runs=3, own_runs=3, slope_seeds=3, slope_powers=range(4, 9), scene_seeds=3, powers=range(0, 9, 4))


class Subject(NamedTuple):
    """A scene in the form of each renderer; `direct` is of direct light only, `centres` sends all rays through the centres of
    pixels."""

    name: str
    size: list
    restir: dict  # arguments of common.restir_render
    mitsuba: dict
    direct: bool = False
    centres: bool = False

    @property
    def depth(self):
        return 2 if self.direct else DEPTH


class Contender(NamedTuple):
    """A way to render: `run` maps a size, one of `counts` (of samples or frames) and a seed to an image and seconds."""

    name: str
    counts: tuple
    run: Callable


class Measured(NamedTuple):
    """What the runs of a contender gave at one count."""

    contender: Contender
    count: int
    seconds: list
    images: list

    @property
    def median(self):
        return statistics.median(self.seconds)


# The scenes, as both renderers are given them.


def subjects(arguments, folder):
    """All scenes of the comparison, one after the other, since each is large."""
    scaled = lambda width, height: [round(side * arguments.effort.scale) for side in (width, height)]
    size = scaled(192, 192)
    yield Subject("Cornell box", size, {"scene": "cornell-mitsuba"}, common.mitsuba_cornell_box(size))
    yield dragon(arguments, folder / "dragon", scaled(256, 192))
    lights = functools.partial(built_in, arguments, "many-lights", folder / "many-lights", scaled(160, 120), direct=True)
    yield lights("many-lights")
    yield lights("many-lights, centres of pixels", centres=True)
    yield built_in(arguments, "ajar", folder / "ajar", scaled(128, 96), "ajar")
    yield built_in(arguments, "glass", folder / "glass", scaled(192, 144), "glass")


def built_in(arguments, scene, folder, size, title, **kind):
    return subject(title, folder, size, common.plain_scene(arguments.restir, scene, folder), **kind)


def dragon(arguments, folder, size):
    mesh, env = arguments.data / "dragon_res3.glb", arguments.data / "studio.exr"
    objects, camera, texture, environments = common.plain_scene(arguments.restir, mesh, folder, env)
    for object in objects:
        object.positions *= np.float32(DRAGON_SCALE)
        object.material = DRAGON
    camera |= {key: [DRAGON_SCALE * x for x in camera[key]] for key in ("position", "target")}
    return subject("dragon under studio", folder, size, (objects, camera, texture, environments))


def subject(title, folder, size, scene, **kind):
    objects, camera, texture, environments = scene
    path = folder / "scene.glb"
    common.write_glb(path, objects, camera, texture)
    ours, theirs = environments or (None, None)
    # Mitsuba scatters once from a rough surface
    restir = {"scene": path, "env": ours, "settings": ["multiscatter=off"]}
    return Subject(title, size, restir, common.mitsuba_scene(folder, objects, camera, size, theirs, texture), **kind)


# The contenders.


def by_restir(arguments, subject, name, words, settings=(), unit="--spp", count=SPP):
    output = arguments.folder / "restir.exr"
    scene = subject.restir | {"settings": [*settings, *subject.restir.get("settings", [])]}
    jitter = "--no-jitter" if subject.centres else "--jitter"

    def run(size, count, seed):
        asked = [*words, jitter, unit, str(count)]
        return common.restir_render(arguments.restir, size=size, seed=seed, output=output, words=asked, **scene)

    return Contender(name, (count,), run)


def paths(arguments, subject, settings=()):
    return by_restir(arguments, subject, "path", ["--max-depth", str(subject.depth)], settings)


def reservoirs(arguments, subject, settings):
    """The mean of a few frames of ReSTIR DI, each of one camera ray a pixel, but for what that sees directly."""
    words = ["--technique", "restir-di", "--accumulate"]
    name = f"ReSTIR DI, {settings.removeprefix('preset=')}"
    seen = [] if subject.centres else [f"seen_rays={SEEN_RAYS}"]
    return by_restir(arguments, subject, name, words, [*settings.split(","), *seen], "--frames", FRAMES)


def by_mitsuba(subject, variant):
    """All samplers of a variant. For direct light alone there is an integrator that takes more points on lights from a hit."""
    mi.set_variant(variant)
    scene = mi.load_dict({key: value for key, value in subject.mitsuba.items() if key != "sensor"})
    integrators = {"": common.path_tracer(subject.depth)}
    if subject.direct:
        direct = {"type": "direct", "emitter_samples": 4, "bsdf_samples": 1}
        integrators[", 4 light samples"] = mi.load_dict(direct)
    return [
        mitsuba_contender(subject, scene, variant, sampler, sampler + note, integrator)
        for sampler in SAMPLERS
        for note, integrator in integrators.items()
    ]


def mitsuba_contender(subject, scene, variant, sampler, name, integrator):
    rounded = lambda count: mi.load_dict({"type": sampler, "sample_count": count}).sample_count()
    counts = tuple(sorted({rounded(1 << k) for k in range(MOST_SAMPLES.bit_length())}))
    render = mitsuba_centres if subject.centres else common.mitsuba

    @functools.cache
    def sensor(size):
        kind = {"film": common.film(size), "sampler": {"type": sampler}}
        return mi.load_dict(subject.mitsuba["sensor"] | kind)

    def run(size, count, seed):
        mi.set_variant(variant)
        camera = sensor(tuple(size))
        begin = time.perf_counter()
        image = render(scene, integrator, count, seed, camera)
        return image, time.perf_counter() - begin

    return Contender(name, counts, run)


def mitsuba_centres(scene, integrator, spp, seed, sensor):
    """As `common.mitsuba` with all rays through the centres of the pixels, which no sampler of Mitsuba's offers."""
    width, height = sensor.film().size()
    lanes = width * height * spp
    sampler = sensor.sampler().clone()
    sampler.set_sample_count(spp)
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(seed, lanes)
    pixel = dr.arange(mi.UInt32, lanes) // spp
    at = mi.Point2f((mi.Float(pixel % width) + 0.5) / width, (mi.Float(pixel // width) + 0.5) / height)
    ray, _ = sensor.sample_ray_differential(0.0, 0.5, at, mi.Point2f(0.5))
    radiance, _, _ = integrator.sample(scene, sampler, ray)
    dr.eval(radiance)
    means = [np.array(dr.block_sum(channel, spp), dtype=np.float64) / spp for channel in radiance]
    return np.stack(means, -1).reshape(height, width, 3)


# Errors.


def errors(images, reference):
    """RMSE and relMSE of one of several images that an unbiased renderer made with different seeds."""
    variance = np.var(images, axis=0, ddof=1)
    return {"RMSE": variance.mean() ** 0.5, "relMSE": (variance / (reference**2 + REL_MSE_EPSILON)).mean()}


def best_mean(measured):
    """The mean of all images, in which one counts the more the smaller its squared error is."""
    weights = [len(m.images) / np.var(m.images, axis=0, ddof=1).mean() for m in measured]
    return np.average([np.mean(m.images, axis=0) for m in measured], axis=0, weights=weights)


def jackknife(statistic, count):
    """A statistic of all runs, and its standard error from what it is without each of them."""
    runs = list(range(count))
    without = np.array([statistic([k for k in runs if k != left]) for left in runs])
    return statistic(runs), float(np.sqrt((count - 1) * np.var(without)))


def picked(images, runs):
    return [images[k] for k in runs]


def seconds_at(points, target):
    """When a contender of (seconds, error)s has the error `target`: a power law between the two counts around it, the first
    such two, and beyond the ends that of the last two."""
    points = sorted(points)
    pairs = list(zip(points, points[1:]))
    inside = [pair for pair in pairs if pair[0][1] >= target >= pair[1][1]]
    (t0, e0), (t1, e1) = inside[0] if inside else pairs[0 if target > points[0][1] else -1]
    return t0 * (t1 / t0) ** (np.log(e0 / target) / np.log(e0 / e1))


# Time to equal error.


def measure(plan, size, runs):
    """Runs the (contender, count)s of a plan by renderers in turns, after a run of each that compiles and warms up."""
    results = {renderer: [Measured(*entry, [], []) for entry in entries] for renderer, entries in plan.items()}
    for seed in range(runs + 1):
        for result in (result for list_ in results.values() for result in list_):
            image, seconds = result.contender.run(size, result.count, seed)
            if seed > 0:
                result.seconds.append(seconds)
                result.images.append(image)
    return results


def tried(contender, size, count, runs=TRIES):
    """A few runs, of which the seconds are those of the fastest, as the first compiles."""
    images, seconds = zip(*(contender.run(size, count, 100 + k) for k in range(runs)))
    return Measured(contender, count, [min(seconds)], list(images))


def near_spp(contender):
    """Its count nearest to what restir is measured with."""
    return min(contender.counts, key=lambda count: abs(np.log(count / SPP)))


def products(measured, reference):
    """Squared error times seconds, by which samplers are chosen."""
    result = errors(measured.images, reference)
    return {"RMSE": result["RMSE"] ** 2 * measured.median, "relMSE": result["relMSE"] * measured.median}


def best(trials, metric, reference, count=1):
    """The contenders of the least products by an error."""
    return [t.contender for t in sorted(trials, key=lambda trial: products(trial, reference)[metric])[:count]]


def brackets(contender, size, metric, reference, targets):
    """The counts of a contender between which its errors in small images pass the targets."""
    last = len(contender.counts) - 1

    @functools.cache
    def at(index):
        return errors(tried(contender, size, contender.counts[index]).images, reference)[metric]

    needed = set()
    for target in targets:
        upper = contender.counts.index(near_spp(contender))
        while upper < last and at(upper) > target:
            upper += 1
        while upper > 1 and at(upper - 1) <= target:
            upper -= 1
        needed |= {contender.counts[upper - 1], contender.counts[upper]}
    return needed


def compare(arguments, subject, problems):
    """Chooses contenders and counts by small images, then measures them together; what the report says of a scene."""
    small = [side // 2 for side in subject.size]
    variants = [v for v in VARIANTS if v not in problems and not (subject.centres and v == "scalar_rgb")]
    own = [paths(arguments, subject), *(reservoirs(arguments, subject, settings) for settings in RESERVOIRS if subject.direct)]
    own = [tried(contender, small, contender.counts[0], OWN_TRIES) for contender in own]
    trials = {variant: [tried(c, small, near_spp(c)) for c in by_mitsuba(subject, variant)] for variant in variants}
    reference = best_mean([*own, *(trial for list_ in trials.values() for trial in list_)])
    ours = [own[0].contender, *dict.fromkeys(c for m in METRICS if subject.direct for c in best(own[1:], m, reference))]
    plan, chosen = {"restir": [(contender, contender.counts[0]) for contender in ours]}, {}
    for variant, list_ in trials.items():
        against = [trial for trial in own if trial.contender in rivals(ours, variant)]
        entries = {}
        for metric in METRICS:
            chosen[variant, metric] = best(list_, metric, reference, FINALISTS[metric])
            targets = [errors(trial.images, reference)[metric] for trial in against]
            for contender in chosen[variant, metric]:
                counts = brackets(contender, small, metric, reference, targets)
                entries |= dict.fromkeys((contender, count) for count in sorted(counts))
        plan[variant] = list(entries)
    measured = measure(plan, subject.size, arguments.runs)
    while more := lacking(measured, chosen):
        for variant, list_ in measure(more, subject.size, arguments.runs).items():
            measured[variant] += list_
    return {
        "subject": subject,
        "products": {v: {t.contender.name: products(t, reference) for t in list_} for v, list_ in trials.items()},
        "pictures": {(o.contender.name, v): same_picture(o, list_) for o in own for v, list_ in trials.items()},
        "chosen": chosen,
        "ours": measured.pop("restir"),
        "theirs": measured,
    }


def rivals(ours, variant):
    """Those of restir's contenders whose error a variant has to reach; for ReSTIR's, the slow one would take long."""
    return ours if variant != "scalar_rgb" else ours[:1]


def lacking(measured, chosen):
    """The counts that large images turn out to need, because an error of restir's is beyond all of a contender's."""
    reference = best_mean([m for list_ in measured.values() for m in list_])
    more = {}
    for (variant, metric), contenders in chosen.items():
        error = lambda m: errors(m.images, reference)[metric]
        targets = [error(own) for own in rivals(measured["restir"], variant)]
        for contender in contenders:
            points = [m for m in measured[variant] if m.contender == contender]
            first, last = (contender.counts.index(end(m.count for m in points)) for end in (min, max))
            lowest, highest = (end(map(error, points)) for end in (min, max))
            wanted = contender.counts[last + 1 :][:1] if lowest > MARGIN * min(targets) else ()
            wanted += contender.counts[:first][-1:] if MARGIN * highest < max(targets) else ()
            more.setdefault(variant, {}).update(dict.fromkeys((contender, count) for count in wanted))
    return {variant: list(entries) for variant, entries in more.items() if entries}


def equal_error(own, list_, contenders, metric, reference, runs):
    """How some contenders of a variant compare with one of restir's: the fastest's seconds to the same error and its name,
    whether its counts are around that, and restir's seconds over these with their standard error from the images."""
    error = lambda m, kept: errors(picked(m.images, kept), reference)[metric]
    points_of = {contender.name: [m for m in list_ if m.contender == contender] for contender in contenders}

    def fastest(kept):
        """One that reaches the error, if any does: how two noisy errors go on beyond the largest count can look like anything."""
        target = error(own, kept)
        points = {name: [(m.median, error(m, kept)) for m in of] for name, of in points_of.items()}
        reaches = lambda name: min(e for _, e in points[name]) <= MARGIN * target
        _, seconds, name = min((not reaches(name), seconds_at(of, target), name) for name, of in points.items())
        return seconds, name

    everything = range(runs)
    seconds, name = fastest(everything)
    logarithm, spread = jackknife(lambda kept: float(np.log(own.median / fastest(kept)[0])), runs)
    target, their = error(own, everything), [error(m, everything) for m in points_of[name]]
    return {
        "error": target,
        "seconds": seconds,
        "name": name,
        "inside": min(their) <= MARGIN * target and target <= MARGIN * max(their),
        "ratio": (np.exp(logarithm), np.exp(logarithm) * spread),
    }


def same_picture(own, trials):
    """The mean of restir's image over that of all of Mitsuba's, its standard error, and the t of 4 x 4 tiles and channels with
    the degrees of freedom that it has at least."""
    a, b = tiles(own.images), tiles([image for trial in trials for image in trial.images])
    error = np.sqrt(a.var(axis=0, ddof=1) / len(a) + b.var(axis=0, ddof=1) / len(b))
    difference = np.abs(a.mean(axis=0) - b.mean(axis=0))
    t = np.divide(difference, error, out=np.where(difference == 0, 0.0, np.inf), where=error > 0)
    ratio = a.mean() / b.mean()
    spread = sum(x.mean(axis=(1, 2, 3)).var(ddof=1) / len(x) / x.mean() ** 2 for x in (a, b)) ** 0.5
    return ratio, ratio * spread, t, min(len(a), len(b)) - 1


def tiles(images):
    height, width = (side // 4 for side in images[0].shape[:2])
    cut = np.array(images)[:, : 4 * height, : 4 * width]
    return cut.reshape(len(images), 4, height, 4, width, 3).mean(axis=(2, 4))


def summary(result, runs):
    """Of each of restir's contenders and each variant what the tables and the answers need."""
    measured = [*result["ours"], *(m for list_ in result["theirs"].values() for m in list_)]
    reference = best_mean(measured)
    result["errors"] = [(m, errors(m.images, reference)) for m in measured]
    result["equal"] = {
        (own.contender.name, variant): {
            metric: equal_error(own, list_, result["chosen"][variant, metric], metric, reference, runs) for metric in METRICS
        }
        for variant, list_ in result["theirs"].items()
        for own in rivals(result["ours"], variant)
    }
    return result


# restir's samplers beside each other.


def own_samplers(arguments):
    """Squared error times seconds of spread samples over independent ones on the Cornell box, with the area of the pixel and
    through its centre; (RMSE's, relMSE's) with standard errors."""
    side = round(192 * arguments.effort.scale)
    runs = arguments.effort.own_runs
    cells = {}
    for centres in (False, True):
        subject = Subject("", [side, side], {"scene": "cornell-mitsuba"}, {}, centres=centres)
        for sampler in ("sobol", "independent"):
            cells[centres, sampler] = [(paths(arguments, subject, [f"sampler={sampler}"]), SPP)]
    measured = {key: list_[0] for key, list_ in measure(cells, [side, side], runs).items()}
    ratios = {}
    for centres in (False, True):
        pair = [measured[centres, sampler] for sampler in ("sobol", "independent")]
        reference = best_mean(pair)

        def ratio(metric, kept):
            a, b = (products(Measured(m.contender, m.count, m.seconds, picked(m.images, kept)), reference) for m in pair)
            return a[metric] / b[metric]

        time_ratio = pair[0].median / pair[1].median
        ratios[centres] = time_ratio, {m: jackknife(functools.partial(ratio, m), runs) for m in METRICS}
    return ratios


# Slopes.


def slopes(arguments, results):
    """Of each scene and contender the slope of log RMSE over log samples, its upper bound and the RMSEs by counts."""
    effort = arguments.effort
    rows = []
    for result in results[:2]:
        subject = result["subject"]
        size = [48 * subject.size[0] // subject.size[1], 48]
        contenders = {f"restir, {s}": paths(arguments, subject, [f"sampler={s}"]) for s in ("sobol", "independent")}
        if "llvm_ad_rgb" in result["theirs"]:
            best = result["equal"]["path", "llvm_ad_rgb"]["RMSE"]["name"]
            list_ = result["theirs"]["llvm_ad_rgb"]
            contenders[f"Mitsuba, {best}"] = next(m.contender for m in list_ if m.contender.name == best)
        for name, contender in contenders.items():
            all_ = [1 << k for k in effort.slope_powers]
            ladder = contender.counts if name.startswith("Mitsuba") else all_
            counts = [count for count in ladder if all_[0] <= count <= all_[-1]]
            images = [[contender.run(size, count, 1000 + s)[0] for s in range(effort.slope_seeds)] for count in counts]
            rows.append((subject.name, name, *slope(counts, images)))
            print(*rows[-1][:5], flush=True)
    return rows


def slope(counts, images):
    rmse = lambda kept: [np.var(picked(list_, kept), axis=0, ddof=1).mean() ** 0.5 for list_ in images]
    seeds = len(images[0])
    value, error = jackknife(lambda kept: float(np.polyfit(np.log(counts), np.log(rmse(kept)), 1)[0]), seeds)
    bound = common.t_quantile(0.025, seeds - 1) * error
    return value, value - bound, value + bound, counts, rmse(range(seeds))


# Built-in scenes.


def built_in_scenes(arguments):
    """Of each scene and power of two the ratio of spread samples' squared error to independent ones', t of the difference and
    its degrees of freedom; and those where it is significant.

    The error of independent samples is measured at 64 of them and follows for other counts, as it falls as their number does.
    """
    names = subprocess.run([arguments.restir, "scenes", "--names"], capture_output=True, text=True).stdout.split()
    counts = [1 << k for k in arguments.effort.powers]
    table = {}
    for name in names:
        independent = SPP * squared_errors(arguments, name, "independent", SPP)
        for count in counts:
            table[name, count] = welch(count * squared_errors(arguments, name, "sobol", count), independent)
        print(name, *(f"{table[name, count][0]:.2f}" for count in counts), flush=True)
    # what three standard errors are for one comparison
    rate = FALSE_ALARM_OF_THREE_SIGMA / len(table)
    offenders = [key for key, (_, t, freedom) in table.items() if t > common.t_quantile(rate, freedom)]
    return names, counts, table, offenders


def squared_errors(arguments, scene, sampler, count):
    """That of each of several seeds, from the mean of the others. Renders run beside each other, one thread each."""
    words, seeds = ["--spp", str(count), "--threads", "1"], arguments.effort.scene_seeds

    def image(seed):
        output = arguments.folder / f"{sampler}-{seed}.exr"
        settings = [f"sampler={sampler}"]
        return common.restir_render(arguments.restir, scene, [32, 24], seed, output, settings=settings, words=words)[0]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        images = np.array(list(pool.map(image, range(seeds))))
    # x - (sum - x) / (n - 1), whose variance is n / (n - 1) of that of x
    distances = (images - images.mean(axis=0)) * (seeds / (seeds - 1))
    return np.mean(distances**2, axis=(1, 2, 3)) * ((seeds - 1) / seeds)


def welch(a, b):
    """The ratio of two means, Welch's t of their difference and its degrees of freedom."""
    va, vb = (x.var(ddof=1) / len(x) for x in (a, b))
    if va + vb == 0:
        return 1.0, 0.0, 1.0
    freedom = (va + vb) ** 2 / (va**2 / (len(a) - 1) + vb**2 / (len(b) - 1))
    return a.mean() / b.mean(), (a.mean() - b.mean()) / (va + vb) ** 0.5, freedom


# The report.


def answers(results, ratios, slope_rows, scenes):
    """The accepted limits one by one, with what was measured."""
    of = {result["subject"].name: result["equal"] for result in results}
    lines = []

    def say(what, measured, met):
        lines.append(f"| {what} | {measured} | {'' if met is None else 'met' if met else '**not met**'} |")

    def ratio(scene, ours, variant="llvm_ad_rgb", metric="RMSE"):
        return of[scene][ours, variant][metric]["ratio"] if (ours, variant) in of[scene] else None

    def limited(what, scene, limit, ours="path"):
        value = ratio(scene, ours)
        say(what, shown(value) if value else "not run", value[0] <= limit if value else None)

    def best_reservoirs(scene):
        names = [ours for ours, _ in of[scene] if ours.startswith("ReSTIR")]
        return min(names, key=lambda ours: ratio(scene, ours)[0], default="ReSTIR DI")

    beside = "restir's time to equal RMSE over that of `llvm_ad_rgb` with its best sampler"
    limited(f"Cornell box: {beside} at most 1.5", "Cornell box", 1.5)
    limited("the same, goal: at most 1.0", "Cornell box", 1.0)
    limited("dragon under studio: the same at most 1.0", "dragon under studio", 1.0)
    centres, areas = "many-lights, centres of pixels", "many-lights"
    for scene, rays in ((centres, "through the centres"), (areas, "over the area")):
        what = f"many-lights by ReSTIR DI, rays {rays} of pixels: the same at most 1/5"
        limited(what, scene, 0.2, best_reservoirs(scene))
    for scene in ("ajar", "glass"):
        value = ratio(scene, "path")
        say(f"{scene}: the same, reported", shown(value) if value else "not run", None)
    for metric in METRICS:
        scalar = {name: ratio(name, "path", "scalar_rgb", metric) for name in of if ratio(name, "path", "scalar_rgb")}
        worst = max(scalar, key=lambda name: scalar[name][0])
        what = f"path tracing ahead of `scalar_rgb` everywhere by equal {metric}: the largest ratio below 1"
        say(what, f"{shown(scalar[worst])} ({worst})", scalar[worst][0] < 1)
    value = ratios[False][1]["RMSE"]
    say("Cornell box, 64 samples: squared error times seconds at most 1/2 of independent samples'", shown(value), value[0] <= 0.5)
    for scene, name, value, _, upper, *_ in slope_rows:
        if name == "restir, sobol":
            what = f"{scene}: slope of log RMSE over log samples at most -.53, its upper 95 % bound below -.5"
            say(what, f"{value:.3f}, bound {upper:.3f}", value <= -0.53 and upper < -0.5)
    _, _, table, offenders = scenes
    what = "no built-in scene at any power of two worse than independent samples"
    say(what, f"{len(offenders)} of {len(table)}", not offenders)
    return lines


def shown(value):
    return f"{value[0]:.2f} ± {value[1]:.2f}"


def equal_table(results):
    lines = [
        "| scene | restir | Mitsuba | error | restir's seconds | Mitsuba's to the same, with | restir's over Mitsuba's |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    for result in results:
        of_name = {own.contender.name: own for own in result["ours"]}
        for (ours, variant), by_metric in result["equal"].items():
            for metric, equal in by_metric.items():
                far = "" if equal["inside"] else " (extrapolated)"
                lines.append(
                    f"| {result['subject'].name} | {ours} | {variant} | {metric} {equal['error']:.4g} | {of_name[ours].median:.2f} |"
                    f" {equal['seconds']:.2f}{far}, {equal['name']} | {shown(equal['ratio'])} |"
                )
    return lines


def picture_table(results):
    lines = [
        "| scene | restir | Mitsuba | mean of restir's over Mitsuba's | largest t, limit | verdict |",
        "|---|---|---|---:|---:|---|",
    ]
    pictures = [(result["subject"].name, *key, *p) for result in results for key, p in result["pictures"].items()]
    tests = sum(t.size for *_, t, _ in pictures)
    for scene, ours, variant, ratio, error, t, freedom in pictures:
        limit = common.t_quantile(FAMILY_RATE / (2 * tests), freedom)
        verdict = "agree" if t.max() <= limit else "**differ**"
        lines.append(f"| {scene} | {ours} | {variant} | {ratio:.4f} ± {error:.4f} | {t.max():.1f}, {limit:.1f} | {verdict} |")
    return lines


def choice_table(results):
    lines = ["| scene | Mitsuba | " + " | ".join(SAMPLERS) + " |", "|---|---|" + "---:|" * len(SAMPLERS)]
    for result in results:
        for variant, cells in result["products"].items():
            for note in sorted({name.removeprefix(s) for name in cells for s in SAMPLERS if name.startswith(s)}):
                base = cells["independent"]
                shares = [[cells[s + note][m] / base[m] for m in METRICS] for s in SAMPLERS]
                row = " | ".join(f"{rmse:.2f}, {relative:.2f}" for rmse, relative in shares)
                lines.append(f"| {result['subject'].name} | {variant}{note} | {row} |")
    return lines


def points_table(results):
    lines = [
        "| scene | renderer | samples or frames | median | fastest, slowest | RMSE | relMSE |",
        "|---|---|---:|---:|---|---:|---:|",
    ]
    for result in results:
        of = {id(m): f"{variant}, " for variant, list_ in result["theirs"].items() for m in list_}
        for m, error in result["errors"]:
            name = of.get(id(m), "restir, ") + m.contender.name
            lines.append(
                f"| {result['subject'].name} | {name} | {m.count} | {m.median:.3f} s | {min(m.seconds):.3f}, {max(m.seconds):.3f} |"
                f" {error['RMSE']:.5f} | {error['relMSE']:.5f} |"
            )
    return lines


def own_table(ratios):
    lines = ["| rays | seconds, sobol over independent | RMSE² x seconds | relMSE x seconds |", "|---|---:|---:|---:|"]
    for centres, (seconds, by_metric) in ratios.items():
        rays = "through the centre of the pixel (`--no-jitter`)" if centres else "over the area of the pixel (the default)"
        lines.append(f"| {rays} | {seconds:.2f} | {shown(by_metric['RMSE'])} | {shown(by_metric['relMSE'])} |")
    return lines


def slope_table(rows):
    lines = ["| scene | renderer and sampler | slope | 95 % interval | RMSE at |", "|---|---|---:|---|---|"]
    for scene, name, value, lower, upper, counts, rmse in rows:
        ends = f"{counts[0]}: {rmse[0]:.4f}, {counts[-1]}: {rmse[-1]:.5f}"
        lines.append(f"| {scene} | {name} | {value:.3f} | {lower:.3f} to {upper:.3f} | {ends} |")
    return lines


def scene_table(scenes):
    names, counts, table, offenders = scenes
    columns = [count for count in counts if count in (1, 4, 16, 64, 256)]
    lines = ["| scene | " + " | ".join(map(str, columns)) + " | largest t, at |", "|---|" + "---:|" * (len(columns) + 1)]
    for name in names:
        worst = max(counts, key=lambda count: table[name, count][1])
        row = " | ".join(f"{table[name, count][0]:.2f}" for count in columns)
        lines.append(f"| {name} | {row} | {table[name, worst][1]:.1f}, {worst} |")
    listed = lambda keys: ", ".join(f"{name} at {count} ({table[name, count][0]:.2f})" for name, count in keys) or "none"
    beyond = [key for key, (_, t, _) in table.items() if t > 3]
    return lines + ["", f"Worse by more than t = 3, uncorrected: {listed(beyond)}. Worse as corrected: {listed(offenders)}."]


def report(arguments, parts, problems, seconds):
    results, ratios, slope_rows, scenes = parts
    effort, load = arguments.effort, arguments.load
    quick = " --quick" if arguments.quick else ""
    command = f"python3 scripts/speed.py --restir target/release/restir --out docs/speed.md --runs {arguments.runs}{quick}"
    warning = ["**Something else was running: the load average is above 2.5, and times are not to be trusted.**", ""]
    quick_note = ["**Made with `--quick`: small images and few runs, only to show that the script works.**", ""]
    return "\n".join([
        "# Time to equal error",
        "",
        f"Written by `{command}`.",
        "",
        f"{arguments.version}, Mitsuba {mi.__version__}; {common.cpu()}, load average at the end of what is timed {load:.1f}; {seconds / 60:.0f} minutes.",
        "",
        *(warning if load > LOAD_LIMIT else []),
        *(quick_note if arguments.quick else []),
        *(f"Mitsuba's `{variant}` was not run: {problem}\n" for variant, problem in problems.items()),
        "| asked for | measured | |",
        "|---|---|---|",
        *answers(results, ratios, slope_rows, scenes),
        "",
        "± is one standard error from the noise of the images (jackknife over the seeds); times are medians.",
        "",
        "## restir beside Mitsuba",
        "",
        f"Each line: how long Mitsuba takes for the error that restir has with {SPP} samples a pixel (ReSTIR DI: {FRAMES} frames, of"
        f" which the mean counts). All run in turns, on all cores, after a warm-up; medians of {arguments.runs} runs. Loading,"
        " building and compiling do not count. Paths have at most"
        f" {DEPTH} segments, in `many-lights` 2 (direct light, which is what ReSTIR DI renders); nobody plays roulette; the filter"
        " is a box. RMSE and relMSE are as `restir compare` defines them and are known from the differences of images with"
        " different seeds; relMSE divides by the mean of all images. restir is measured at a power of two, which its samples"
        " like best; Mitsuba between two of its own counts by a power law, which is at least as good for it.",
        "",
        *equal_table(results),
        "",
        "Both renderers are given the same scene. The Cornell box is `mi.cornell_box()` with two-sided surfaces. Of the others the"
        " meshes are faceted, plastic is replaced by its diffuse base, metals are white with roughness 0.3 at most, and glass is"
        " smooth and clear, because the renderers model coats, tinted metals, rough glass and shading normals differently; so"
        " `ajar`, `glass` and `many-lights` are not quite those that `restir` has built in. The dragon is diffuse (0.7) and"
        f" {DRAGON_SCALE:.0f} times as large as in its file, as Mitsuba's rays begin a fixed length off a small mesh. Rough metal"
        " scatters once (`multiscatter=off`).",
        "",
        "With rays over the area of pixels most of the squared error of `many-lights` is that of few pixels at the edges of lamps, where"
        f" only the number of rays through the pixel counts: ReSTIR DI has {SEEN_RAYS} a frame for what is seen directly"
        f" (`seen_rays={SEEN_RAYS}`), and one to shade. ReSTIR DI's default are"
        " rays through the centres of pixels; for `llvm_ad_rgb` a loop of its own does that around Mitsuba's integrator."
        " `scalar_rgb` cannot, and beside ReSTIR DI it was not run.",
        "",
        f"The same picture? {OWN_TRIES} images by restir beside all those of half the side by which Mitsuba's samplers were chosen;"
        " of 4x4 tiles and three channels, t is Welch's, and its limit holds the probability of any false alarm in all scenes"
        f" together below {FAMILY_RATE}:",
        "",
        *picture_table(results),
        "",
        "Mitsuba's samplers: squared error times seconds over that of `independent`, by RMSE and by relMSE, of images of half the"
        f" side with {TRIES} seeds. The best two by RMSE and the best by relMSE run above, and the best of them counts. For direct"
        " light, Mitsuba may take four points on lights from a hit (integrator `direct`).",
        "",
        *choice_table(results),
        "",
        "All that was measured:",
        "",
        *points_table(results),
        "",
        "## restir's samples: sobol beside independent",
        "",
        f"Cornell box, {SPP} samples a pixel, {effort.own_runs} runs in turns; squared error times seconds of `sampler=sobol` over"
        " `sampler=independent`:",
        "",
        *own_table(ratios),
        "",
        "## Slopes",
        "",
        f"Slope of log RMSE over log samples at the powers of two from {1 << effort.slope_powers[0]} to"
        f" {1 << effort.slope_powers[-1]} (of Mitsuba, the counts its sampler has), 48 rows of pixels, {effort.slope_seeds} seeds;"
        " the interval is Student's t of the jackknife over the seeds.",
        "",
        *slope_table(slope_rows),
        "",
        "## Built-in scenes",
        "",
        "Squared error of `sampler=sobol` over `sampler=independent` with so many samples, 32x24 pixels,"
        f" {effort.scene_seeds} seeds. That of independent samples is measured at {SPP} and follows for other counts, as it falls as their number does. A scene"
        " is worse at a count if t of the difference (Welch's, over the seeds) is beyond what three standard errors are for one"
        f" comparison, corrected for {len(scenes[2])} of them.",
        "",
        *scene_table(scenes),
        "",
    ])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--restir", required=True, help="the program restir")
    parser.add_argument("--out", type=Path, help="the report to write")
    parser.add_argument("--only", default="", metavar="TEXT", help="compare on scenes with that in their names, and print it: no report")
    parser.add_argument("--runs", type=int, help="runs of the comparison with Mitsuba, at least 3; 5 if not given")
    parser.add_argument("--data", type=Path, default=Path("assets"), help="the folder of dragon_res3.glb and studio.exr")
    parser.add_argument("--quick", action="store_true", help="small images and few runs, only to try this out")
    arguments = parser.parse_args()
    arguments.effort = QUICK if arguments.quick else FULL
    arguments.runs = arguments.runs or arguments.effort.runs
    if arguments.runs < 3:
        parser.error("--runs has to be at least 3, for a standard error")
    if (arguments.out is None) == (not arguments.only):
        parser.error("give either --out, for a report, or --only, for some scenes")
    arguments.version = subprocess.run([arguments.restir, "--version"], capture_output=True, text=True).stdout.strip()
    begin = time.monotonic()
    mi.set_log_level(mi.LogLevel.Error)
    problems = {v: problem for v in VARIANTS if (problem := common.mitsuba_problem(v))}
    with tempfile.TemporaryDirectory() as folder:
        arguments.folder = Path(folder)
        results = []
        for subject in subjects(arguments, arguments.folder):
            if arguments.only not in subject.name:
                continue
            results.append(summary(compare(arguments, subject, problems), arguments.runs))
            print(*equal_table(results[-1:])[2:], f"{time.monotonic() - begin:.0f} s", sep="\n", flush=True)
        if arguments.only:
            return None if results else parser.error(f"--only {arguments.only}: no scene has that in its name")
        parts = []
        for part in (own_samplers, functools.partial(slopes, results=results), built_in_scenes):
            parts.append(part(arguments))
            # the other parts measure no times
            arguments.load = os.getloadavg()[0] if part is own_samplers else arguments.load
            print(f"{time.monotonic() - begin:.0f} s", flush=True)
    text = report(arguments, (results, *parts), problems, time.monotonic() - begin)
    common.write_atomically(arguments.out, text)


if __name__ == "__main__":
    main()
