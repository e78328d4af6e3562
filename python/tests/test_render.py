"""Renders have the program's bits, whoever asks for them and from how many threads."""

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import restir
from conftest import same

SIZE = (40, 30)
RENDERS = [
    ({"technique": "path", "samples": 5}, ["--spp", "5"]),
    ({"technique": "path", "samples": 2, "max_depth": 3, "seed": 7}, ["--spp", "2", "--max-depth", "3", "--seed", "7"]),
    ({"technique": "restir-di", "samples": 4}, ["--frames", "4", "--accumulate"]),
    ({"technique": "restir-di", "frames": 3, "denoise": True}, ["--frames", "3", "--denoise"]),
    ({"technique": "restir-pt", "frames": 3, "settings": {"preset": "default"}}, ["--frames", "3"]),
    (
        {"camera": restir.Camera((278, 273, -700), (278, 273, 0), fov=50), "samples": 2},
        ["--camera", "278,273,-700:278,273,0:50", "--spp", "2"],
    ),
]


@pytest.mark.parametrize(("arguments", "options"), RENDERS)
def test_an_image_has_the_bits_of_the_program(cornell, program, tmp_path, arguments, options):
    if arguments.get("settings") == {"preset": "default"} and "default" not in restir.presets("restir-pt"):
        arguments = {**arguments, "settings": None}
    technique = ["--technique", arguments.get("technique", "path")]
    size = f"{SIZE[0]}x{SIZE[1]}"
    out = str(tmp_path / "a.exr")
    program("render", "cornell", "--device", "cpu", "--size", size, *technique, *options, "-o", out)
    assert same(restir.render(cornell, size=SIZE, **arguments), restir.read(out))


def test_scenes_without_a_camera_are_framed_as_the_program_does(program, tmp_path):
    scene = restir.Scene()
    grey, lamp = scene.add_material(base_color=(0.5, 0.5, 0.5)), scene.add_material(emission=(5, 5, 5))
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
    floor = scene.add_mesh(square, [[0, 2, 1], [0, 3, 2]], grey)
    ceiling = scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], lamp)
    scene.add_instance(floor)
    above = scene.add_instance(ceiling, [[0.3, 0, 0, 0], [0, 0.3, 0, 1], [0, 0, 0.3, 0], [0, 0, 0, 1]])
    lit = restir.render(scene, samples=64, size=SIZE)
    assert lit.color.shape == (30, 40, 3) and np.asarray(lit).max() > 0.1
    # a lamp that is twice as far lights less, and one that is moved back as much as before
    scene.set_transform(above, [[0.3, 0, 0, 0], [0, 0.3, 0, 2], [0, 0, 0.3, 0], [0, 0, 0, 1]])
    scene.camera = restir.Camera((0, 1, 4), (0, 0.3, 0))
    far = restir.render(scene, samples=64, size=SIZE)
    scene.set_positions(ceiling, scene.positions(ceiling) - np.array([0, 1 / 0.3, 0]))
    near = restir.render(scene, samples=64, size=SIZE)
    assert near.color.mean() > 1.5 * far.color.mean()
    assert scene.indices(floor).tolist() == [[0, 2, 1], [0, 3, 2]]
    with pytest.raises(restir.RestirError, match="the mesh has 4 vertices, and 3 positions were given"):
        scene.set_positions(floor, square[:3])
    with pytest.raises(restir.RestirError, match="transpose it"):
        scene.set_transform(above, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [3, 0, 0, 1]])


def test_arrays_are_those_of_the_image_without_a_copy(cornell, tmp_path):
    image = restir.render(cornell, samples=1, size=SIZE, layers=["albedo", "depth", "id"])
    assert image.color.dtype == np.float32 and image.color.flags.c_contiguous
    assert np.asarray(image) is image.color and image["color"] is image.color
    assert np.shares_memory(np.from_dlpack(image), image.color)
    assert memoryview(image.color).shape == (30, 40, 3)
    assert {name: layer.shape for name, layer in image.layers.items()} == {
        "albedo": (30, 40, 3),
        "depth": (30, 40),
        "id": (30, 40),
    }
    image.write(tmp_path / "a.exr")
    image.write(tmp_path / "a.png")
    again = restir.read(tmp_path / "a.exr")
    assert same(again, image) and again.metadata["technique"] == "path"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_the_layers_of_a_technique(cornell):
    image = restir.render(cornell, technique="restir-di", frames=2, size=SIZE, inspect=True)
    assert image["reservoir.M"].max() > 1


def test_a_gpu_has_the_bits_of_the_cpu(cornell):
    if not restir.devices():
        assert "RESTIR_REQUIRE_GPU" not in os.environ, "there is no adapter"
        pytest.skip("there is no adapter")
    on = [restir.render(cornell, samples=3, size=SIZE, device=device) for device in ("cpu", "gpu")]
    assert same(*on)
    # what is called meanwhile cannot wait for the same device
    again = lambda _: restir.render(cornell, samples=1, size=SIZE, device="gpu")
    with pytest.raises(restir.RestirError, match="works for this thread already"):
        restir.render(cornell, samples=3, size=SIZE, device="gpu", progress=again)


def test_two_threads_render_at_once(cornell):
    expected = restir.render(cornell, samples=32, size=(160, 120))
    images, during = [None, None], []

    def work(index):
        images[index] = restir.render(cornell, samples=32, size=(160, 120), progress=lambda _: during.append(index))

    threads = [threading.Thread(target=work, args=(index,)) for index in range(2)]
    for thread in threads:
        thread.start()
    ticks = 0
    while any(thread.is_alive() for thread in threads):
        ticks += 1
        time.sleep(0.001)
    assert all(same(image, expected) for image in images)
    assert set(during) == {0, 1}
    # the interpreter went on meanwhile
    assert ticks > 10


def test_ctrl_c_ends_a_render(cornell):
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        restir.render(cornell, samples=1 << 20, size=(256, 256))
    assert time.monotonic() - start < 30


def test_what_a_callback_raises_ends_a_render(cornell):
    def stop(share):
        raise RuntimeError(f"enough at {share >= 0}")

    with pytest.raises(RuntimeError, match="enough at True"):
        restir.render(cornell, samples=1 << 20, size=(256, 256), progress=stop)


def test_memory_does_not_grow(cornell):
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def work():
        restir.render(cornell, samples=1, size=(128, 128), layers=["albedo"])
        restir.render(cornell, technique="restir-di", frames=2, size=(128, 128))

    for _ in range(10):
        work()
    before = resident()
    for _ in range(190):
        work()
    # an image that stays has 196 608 bytes: 190 of them would be 37 MB
    assert resident() - before < 8 << 20


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"technique": "nope"}, "there is no technique \"nope\"; there are: path"),
        ({"settings": {"nope": 1}}, "there is no setting \"nope\""),
        ({"max_depth": 0}, "max_depth is 0; it has to be"),
        ({"size": (0, 4)}, "an image of 0x4 pixels has no pixel"),
        ({"samples": 1, "frames": 1}, "give samples for the mean, or frames"),
        ({"frames": 2}, "path has no frames that reuse each other; give samples"),
        ({"layers": ["nope"]}, "there is no layer \"nope\"; there are"),
        ({"device": "nope"}, "there is no device \"nope\"; there are: cpu, gpu"),
        ({"samples": 2.5}, "the number of samples or frames is 2.5; give a whole number from 1"),
        ({"seed": 1 << 40}, "give a whole number from 0 to 4294967295"),
        ({"size": 64}, "size is 64; give (width, height) in pixels"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(cornell, arguments, sentence):
    with pytest.raises(restir.RestirError) as raised:
        restir.render(cornell, **arguments)
    assert sentence in str(raised.value)


def test_arrays_that_are_no_mesh_are_refused(tmp_path):
    scene = restir.Scene()
    corners = np.eye(3)
    for positions, indices, sentence in [
        (corners, [[0.0, 1.0, 2.5]], "indices are to be whole numbers"),
        (corners, [[0, 1, -1]], "indices are to be whole numbers"),
        (corners, [0, 1, 2], "indices have the shape (3,); give an array of 2 dimensions"),
        (corners[:, :2], [[0, 1, 2]], "positions has 2 values a row; give 3"),
        ("abc", [[0, 1, 2]], "positions cannot be made an array of numbers"),
    ]:
        with pytest.raises(restir.RestirError) as raised:
            scene.add_mesh(positions, indices, 0)
        assert sentence in str(raised.value)
    # what is built later is judged then, with the names of its parts
    scene.add_instance(scene.add_mesh(corners, [[0, 1, 7]], 0, name="odd"))
    with pytest.raises(restir.RestirError):
        restir.render(scene, size=SIZE, samples=1)
    # any order in memory will do
    turned = restir.Scene()
    turned.add_mesh(np.asfortranarray(corners), np.array([[0, 1, 2]], np.int8), turned.add_material())
    assert turned.positions(0).tolist() == corners.tolist()
    with pytest.raises(restir.RestirError, match=r"to an \.exr or a \.png file"):
        restir.Image(np.zeros((2, 2, 3), np.float32)).write(tmp_path / "a.jpg")


def test_a_missing_file_is_named():
    with pytest.raises(restir.RestirError, match=r"missing\.glb"):
        restir.load("missing.glb")
