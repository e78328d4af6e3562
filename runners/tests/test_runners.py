"""Programs in other languages render plans: in an empty folder, with the plan alone."""

import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import restir
from scipy import stats

RUNNERS = Path(__file__).parents[1]
PROGRAM = os.environ.get("RESTIR_PROGRAM", "restir")
SIZE = 32
SCENES = {
    "cornell": ["cornell", "--spp", "16"],
    "many-lights": ["many-lights", "--technique", "restir-di", "--frames", "4"],
    "ajar": ["ajar", "--technique", "restir-pt", "--turntable", "16"],
    "moving": ["moving", "--technique", "restir-di", "--frames", "5"],
}
# Mesa's layer that chooses a device asks for a display
QUIET = {**os.environ, "NODEVICE_SELECT": "1"}


def run(*command, cwd=None):
    done = subprocess.run([str(word) for word in command], cwd=cwd, env=QUIET, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


def job(scene, seed):
    return [*SCENES[scene], "--size", f"{SIZE}x{SIZE}", "--seed", str(seed)]


def export(folder, scene, forms, seed=0):
    run(PROGRAM, "export-plan", *job(scene, seed), "-o", folder, "--to", ",".join(forms))
    return folder


def on_cpu(folder, scene, seed=0):
    """The image of the last frame, by the CPU."""
    arguments = job(scene, seed)
    if "--turntable" in arguments:
        run(PROGRAM, "render", *arguments, "--device", "cpu", "-o", folder / "cpu.####.exr")
        return np.asarray(restir.read(sorted(folder.glob("cpu.*.exr"))[-1]).color)
    run(PROGRAM, "render", *arguments, "--device", "cpu", "-o", folder / "cpu.exr")
    return np.asarray(restir.read(folder / "cpu.exr").color)


def read_pfm(path):
    kind, size, scale, pixels = path.read_bytes().split(b"\n", 3)
    assert (kind, float(scale)) == (b"PF", -1.0)
    width, height = map(int, size.split())
    return np.frombuffer(pixels, "<f4").reshape(height, width, 3)[::-1]


def words(image):
    return np.ascontiguousarray(image).view("<u4")


@pytest.fixture(scope="session")
def in_c(tmp_path_factory):
    """The runner in C, compiled in a folder of its own."""
    folder = tmp_path_factory.mktemp("c")
    for name in ["run_plan.c", "jsmn.h"]:
        shutil.copy(RUNNERS / "c" / name, folder)
    run("cc", "-O2", "-Wall", "-Werror", "-o", "run_plan", "run_plan.c", "-lvulkan", cwd=folder)

    def render(plan):
        empty = tmp_path_factory.mktemp("empty")
        shutil.copy(folder / "run_plan", empty)
        run("./run_plan", plan, "image.pfm", cwd=empty)
        return read_pfm(empty / "image.pfm")

    return render


@pytest.fixture(scope="session")
def in_python(tmp_path_factory):
    """The runner in Python, in an empty folder."""

    def render(plan, *more):
        empty = tmp_path_factory.mktemp("empty")
        shutil.copy(RUNNERS / "python" / "run_plan.py", empty)
        run(sys.executable, "run_plan.py", plan, "image.pfm", *more, cwd=empty)
        return read_pfm(empty / "image.pfm")

    return render


@pytest.mark.parametrize("scene", SCENES)
def test_c_gives_the_bits_of_the_cpu(scene, in_c, tmp_path):
    image = in_c(export(tmp_path / "plan", scene, ["spirv"]))
    expected = on_cpu(tmp_path, scene)
    assert expected.any()
    differ = int((words(image) != words(expected)).sum())
    assert differ == 0, f"{differ} of {image.size} words differ"


class Server(ThreadingHTTPServer):
    """Serves a folder, and keeps what a page sends: images, and a sentence at the end."""

    class Handler(SimpleHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(200)
            self.end_headers()
            if len(body) == 16 * SIZE * SIZE:
                self.server.images.append(np.frombuffer(body, "<f4").reshape(SIZE, SIZE, 4)[..., :3])
            else:
                self.server.said = body.decode()
                self.server.done.set()

        def log_message(self, *_):
            pass

    def __init__(self, folder):
        super().__init__(("127.0.0.1", 0), partial(self.Handler, directory=folder))
        self.images, self.said, self.done = [], "nothing", threading.Event()


def in_browser(folder, plan, query):
    """What headless Chromium renders on its software adapter, in a folder with the page and the plan."""
    browser = shutil.which("chromium") or pytest.skip("chromium is not installed")
    folder.mkdir()
    shutil.copy(RUNNERS / "web" / "run_plan.html", folder)
    shutil.copytree(plan, folder / "plan")
    server = Server(folder)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    flags = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--enable-unsafe-webgpu", "--enable-features=Vulkan"]
    adapter = "--use-webgpu-adapter=swiftshader"
    address = f"http://127.0.0.1:{server.server_port}/run_plan.html?plan=plan&to=/image&{query}"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, open(folder / "log", "w") as log:
        command = [browser, *flags, adapter, f"--user-data-dir={profile}", address]
        process = subprocess.Popen(command, env=QUIET, stdout=log, stderr=log, start_new_session=True)
        try:
            ended = server.done.wait(420)
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            server.shutdown()
    assert ended, f"{(folder / 'log').read_text()[-2000:]}"
    if server.said.startswith(("This browser has no WebGPU", "This browser finds no GPU")):
        pytest.skip(server.said)
    return server.images, server.said


def tiles(image):
    """The means of sixteen tiles, by colour."""
    return image.reshape(4, SIZE // 4, 4, SIZE // 4, 3).mean((1, 3), dtype="f8").ravel()


def largest_deviation(of_runner, of_cpu):
    """Of the tiles' means over seeds, in units of what is allowed.

    Both have the same seeds, so that they differ by rounding, and where a path goes elsewhere because of it. Allowed are as many standard errors of
    the mean difference, by Student's t, as 3 are to a single normal number, corrected for the number of tiles (a false alarm in 370 runs of other
    seeds; these are fixed), and 1e-5 of the mean: divisions of WGSL may be off by 2.5 units in the last place, 3e-7, and a path has dozens.
    """
    difference = np.array(of_runner) - np.array(of_cpu)
    n, tiles = difference.shape
    chance = 2 * (1 - statistics.NormalDist().cdf(3)) / tiles
    error = stats.t.isf(chance / 2, n - 1) * difference.std(0, ddof=1) / np.sqrt(n)
    allowed = error + 1e-5 * np.mean(of_cpu, axis=0)
    return float(np.max(np.abs(difference.mean(0)) / np.where(allowed > 0, allowed, 1e-30)))


@pytest.mark.parametrize("scene", ["cornell", "many-lights", "ajar"])
def test_python_agrees_in_the_means_of_tiles(scene, in_python, tmp_path):
    of_runner, of_cpu = [], []
    for seed in range(8):
        of_runner.append(tiles(in_python(export(tmp_path / f"plan{seed}", scene, ["wgsl"], seed))))
        of_cpu.append(tiles(on_cpu(tmp_path, scene, seed)))
    assert largest_deviation(of_runner, of_cpu) < 1
    # excludes that a tile of average noise is off by a hundredth of the image's mean
    typical = np.argsort(np.std(of_cpu, axis=0))[len(of_cpu[0]) // 2]
    wrong = np.array(of_runner)
    wrong[:, typical] += 0.01 * np.mean(of_cpu)
    assert largest_deviation(wrong, of_cpu) > 1


def test_the_browser_agrees_in_the_means_of_tiles(tmp_path):
    """Chromium's software adapter compiles path tracing in half a minute, and gives up on ReSTIR PT after three."""
    images, said = in_browser(tmp_path / "site", export(tmp_path / "plan", "cornell", ["wgsl"]), "seeds=8")
    assert len(images) == 8 and "of compiling" in said, said
    of_cpu = [on_cpu(tmp_path, "cornell", seed) for seed in range(8)]
    near = np.isclose(images, of_cpu, rtol=1e-3, atol=1e-6).all(-1).mean()
    assert near > 0.98, f"{near:.3f} of the pixels are near"
    assert largest_deviation([tiles(image) for image in images], [tiles(image) for image in of_cpu]) < 1


def test_the_page_says_what_is_wrong(tmp_path):
    images, said = in_browser(tmp_path / "site", export(tmp_path / "plan", "cornell", ["spirv"]), "")
    assert not images and said == "The plan has no WGSL; export it with --to wgsl."


@pytest.mark.parametrize("scene", ["cornell", "ajar"])
def test_python_renders_the_cpus_image_but_for_rounding(scene, in_python, tmp_path):
    image = in_python(export(tmp_path / "plan", scene, ["wgsl"]))
    expected = on_cpu(tmp_path, scene)
    near = np.isclose(image, expected, rtol=1e-3, atol=1e-6).all(-1).mean()
    assert near > 0.99, f"{near:.3f} of the pixels are near"


def test_parameters_are_set_by_name(in_python, tmp_path):
    plan = export(tmp_path / "plan", "cornell", ["wgsl"])
    other = in_python(plan, "--set", "seed=7")
    assert np.isclose(other, on_cpu(tmp_path, "cornell", 7), rtol=1e-3, atol=1e-6).all(-1).mean() > 0.99


@pytest.mark.parametrize("scene", ["cornell", "many-lights", "ajar"])
def test_glsl_renders_the_cpus_image_but_for_rounding(scene, in_c, tmp_path):
    """glslang compiles it to SPIR-V. What naga wrote of loops before was black."""
    if not shutil.which("glslangValidator"):
        pytest.skip("glslangValidator is not installed")
    plan = export(tmp_path / "plan", scene, ["spirv", "glsl"])
    document = json.loads((plan / "plan.json").read_text())
    for kernel in document["kernels"]:
        source, module = kernel["modules"]["glsl"], kernel["modules"]["spirv"]
        compiled = plan / module["file"]
        run("glslangValidator", "-V", "--target-env", "vulkan1.2", "-S", "comp", plan / source["file"], "-o", compiled)
        module["entry"] = source["entry"]
    (plan / "plan.json").write_text(json.dumps(document))
    image, expected = in_c(plan), on_cpu(tmp_path, scene)
    near = np.isclose(image, expected, rtol=1e-3, atol=1e-6).all(-1).mean()
    assert near > 0.99, f"{near:.3f} of the pixels are near"


@pytest.mark.parametrize("scene", SCENES)
def test_plans_follow_their_schema(scene, tmp_path):
    schema = json.loads((RUNNERS.parent / "docs" / "plan.schema.json").read_text())
    plan = export(tmp_path / "plan", scene, ["spirv", "wgsl", "msl", "hlsl", "glsl"])
    document = json.loads((plan / "plan.json").read_text())
    jsonschema.validate(document, schema)
    document["passes"][0]["kernel"] = "path"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


def test_what_runners_refuse(in_python, in_c, tmp_path):
    plan = export(tmp_path / "plan", "cornell", ["wgsl"])
    document = json.loads((plan / "plan.json").read_text())
    with pytest.raises(AssertionError, match="export it with --to spirv"):
        in_c(plan)
    for more, said in [("nothing=1", "no kernel has a parameter nothing"), ("seed=-1", "whole number"), ("position=1", "has 3 numbers")]:
        with pytest.raises(AssertionError, match=said):
            in_python(plan, "--set", more)
    (plan / "plan.json").write_text(json.dumps({**document, "version": 2}))
    for render in [in_c, in_python]:
        with pytest.raises(AssertionError, match="another version"):
            render(plan)


DAMAGES = [
    ('"kernel":0', '"kernel":99', "names what is not there"),
    ('"workgroups":[', '"workgroups":[],"x":[', "too short"),
    ('"frames":[[', '"frames":[],"x":[[', "too short"),
    ('"geometry":[', '"geometry":[99,', "names what is not there"),
    ('"bytes":', '"bytes":0,"x":', "without bytes"),
    ('"outputs": [', '"outputs": [{"buffer":77,"what":"image"},', "names what is not there"),
    ('"uploads": []', '"uploads": [{"frame":0,"buffer":0,"byte":0,"bytes":99999999,"file":"plan.json","at":0}]', "what is not there"),
    ('"params":[', '"params":"none","x":[', "too short"),
    ("restir-plan", "another", "another version"),
]


@pytest.mark.parametrize("old,new,said", DAMAGES)
def test_c_refuses_damaged_plans(old, new, said, in_c, tmp_path):
    plan = export(tmp_path / "plan", "cornell", ["spirv"])
    text = (plan / "plan.json").read_text()
    assert old in text
    at = text.rindex(old) if old.startswith('"kernel"') or "params" in old or "geometry" in old else text.index(old)
    (plan / "plan.json").write_text(text[:at] + new + text[at + len(old) :])
    with pytest.raises(AssertionError, match=said):
        in_c(plan)


def test_c_refuses_a_plan_that_is_cut(in_c, tmp_path):
    plan = export(tmp_path / "plan", "cornell", ["spirv"])
    text = (plan / "plan.json").read_text()
    (plan / "plan.json").write_text(text[: len(text) // 2])
    with pytest.raises(AssertionError, match="damaged"):
        in_c(plan)


def test_runners_are_short():
    for runner in ["c/run_plan.c", "python/run_plan.py", "web/run_plan.html"]:
        assert len((RUNNERS / runner).read_text().splitlines()) <= 400
