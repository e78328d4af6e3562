"""Sessions, parts, comparisons and what there is."""

import doctest
import importlib.util
import json

import numpy as np
import pytest
import restir
from conftest import REPOSITORY, same

SIZE = (40, 30)


def test_the_examples_of_the_documentation_hold():
    assert doctest.testmod(restir).failed == 0


def test_the_stub_names_what_there_is():
    from restir import _restir

    spec = importlib.util.find_spec("restir")
    stub = (spec.submodule_search_locations[0] + "/_restir.pyi", spec.submodule_search_locations[0] + "/py.typed")
    text = open(stub[0]).read()
    assert open(stub[1]).read() == ""
    public = [name for name in dir(_restir) if not name.startswith("__")]
    missing = [name for name in public if f"def {name}(" not in text and f"class {name}" not in text]
    members = [f"def {name}(" for name in dir(_restir.Scene) if not name.startswith("_")]
    assert not missing and all(member in text for member in members)


def test_everything_public_has_a_docstring():
    for name in restir.__all__:
        item = getattr(restir, name)
        assert item.__doc__, name
        if isinstance(item, type) and item.__module__ == "restir":
            members = [member for member in vars(item) if not member.startswith("_")]
            fields = getattr(item, "__dataclass_fields__", {})
            assert all(getattr(item, member).__doc__ for member in members if member not in fields), name


def test_frames_of_a_session_are_those_of_a_render(cornell):
    session = restir.Session(cornell, technique="restir-di", size=SIZE)
    frames = [session.render() for _ in range(4)]
    assert session.frames == 4 and session.history == "kept"
    assert same(frames[-1], restir.render(cornell, technique="restir-di", frames=4, size=SIZE))
    edited = cornell.copy()
    edited.set_transform(0, np.diag([1.0, 1.0, 0.9, 1.0]))
    assert not same(session.render(scene=edited), frames[-1]) and session.history == "kept"
    session.reset()
    assert session.frames == 0
    with pytest.raises(restir.RestirError, match="give scene or frame"):
        session.render(scene=edited, frame=1.0)


def test_parts_are_merged_to_the_bits_of_one_render(cornell, tmp_path, program):
    whole = restir.render(cornell, samples=13, size=SIZE)
    parts = [tmp_path / f"{index}.part" for index in range(3)]
    common = {"size": SIZE, "of": 13}
    restir.render_part(parts[0], cornell, samples=range(0, 5), **common)
    restir.render_part(parts[1], cornell, samples=range(5, 13), tile=restir.Tile(0, 0, 40, 11), **common)
    with pytest.raises(restir.RestirError, match=r"--samples 5\.\.12 --tile 40x19\+0\+11"):
        restir.merge(parts[:2])
    # one of them by the program
    tile = ["--tile", "40x19+0+11", "--size", "40x30", "--device", "cpu"]
    program("render", "cornell", "--samples", "5..12", *tile, "-o", str(parts[2]))
    merged = restir.merge(parts)
    assert same(merged, whole) and merged.metadata["samples"] == "13"
    noise, count = restir.noise(parts)
    assert count == 13 and 0.0 < noise < 10.0
    with pytest.raises(restir.RestirError, match="it is given twice"):
        restir.merge([*parts, parts[0]])
    with pytest.raises(restir.RestirError, match="give a list of the files of all parts"):
        restir.merge(str(parts[0]))
    for more, sentence in [
        ({}, "give one range of them"),
        ({"samples": range(0, 4, 2)}, "give consecutive ones"),
        ({"samples": range(4), "frames": 3}, "a number of them is for chains"),
        ({"frames": range(4), "technique": "restir-di"}, "this is a part of frames; leave it out"),
        ({"samples": range(4), "max_depth": 3, "settings": {"max_depth": 4}}, "max_depth was given twice"),
        ({"samples": range(4), "frame": float("nan")}, "frame is nan; give a number"),
        ({"samples": 3}, "give a range of them"),
        ({"samples": range(4), "tile": (0, 0, 1, 1)}, "is no tile; give a restir.Tile"),
        ({"samples": range(4), "camera": (0, 0, 0)}, "is no camera; give a restir.Camera"),
        ({"samples": range(14)}, "ends with sample 13, and the image has 13"),
    ]:
        with pytest.raises(restir.RestirError, match=sentence):
            restir.render_part(parts[0], cornell, **common, **more)


@pytest.mark.parametrize("camera", [None, restir.Camera((0, 1, 6), (0, 0, 0))])
def test_parts_of_python_and_of_the_program_are_of_one_render(tmp_path, program, camera):
    # the file has no camera: it is framed, or seen from where both are told
    name = str(REPOSITORY / "assets/suzanne.glb")
    scene = restir.load(name, default_light=True)
    parts = [tmp_path / "a.part", tmp_path / "b.part"]
    restir.render_part(parts[0], scene, samples=range(0, 2), size=SIZE, camera=camera)
    seen = [] if camera is None else ["--camera", "0,1,6:0,0,0"]
    given = ["--default-light", "--size", "40x30", "--device", "cpu", "--samples", "2..3", *seen]
    program("render", name, *given, "-o", str(parts[1]))
    whole = restir.render(scene, samples=4, size=SIZE, camera=camera)
    assert same(restir.merge(parts), whole)
    session = restir.Session(scene, technique="path", samples=4, size=SIZE)
    assert same(session.render(camera=camera), whole)


def test_chains_and_frames_have_parts(cornell, tmp_path):
    common = {"technique": "restir-di", "size": SIZE}
    chains = [tmp_path / "a.part", tmp_path / "b.part", tmp_path / "all.part"]
    for path, span in zip(chains, [range(0, 2), range(2, 5), range(0, 5)], strict=True):
        restir.render_part(path, cornell, chains=span, frames=2, **common)
    assert same(restir.merge(chains[:2]), restir.merge(chains[2:]))
    frames = [tmp_path / "c.part", tmp_path / "d.part"]
    for path, span in zip(frames, [range(0, 3), range(3, 5)], strict=True):
        restir.render_part(path, cornell, frames=span, **common)
    assert same(restir.merge(frames), restir.render(cornell, samples=5, **common))


def test_an_explanation_has_numbers_and_text(cornell):
    explained = restir.explain(cornell, (20, 15), technique="restir-di", frames=3, size=SIZE)
    assert "pixel (20, 15)" in explained["text"]
    assert json.dumps(explained)
    with pytest.raises(restir.RestirError, match="outside of the image"):
        restir.explain(cornell, (40, 0), size=SIZE)


def test_what_there_is():
    assert restir.techniques()["restir-di"].repeats == "frames"
    assert restir.settings("path")["max_depth"].default == "8"
    assert "cornell" in restir.scenes()
    assert restir.biases("restir-di") == []


def test_a_bench_tells_more_samples_from_fewer(cornell):
    reference = restir.render(cornell, samples=2048, size=(16, 12))
    few, many = restir.bench(
        cornell, {"few": {"samples": 4}, "many": {"samples": 64}}, reference=reference, repeats=3, size=(16, 12)
    )
    assert many["rmse"] < 0.5 * few["rmse"] and many["seconds"] > 0.0 and few["name"] == "few"


def test_an_environment_and_a_medium(tmp_path):
    scene = restir.load("cube")
    black = restir.render(scene, samples=2, size=(12, 8))
    scene.set_environment([1.0, 2.0, 3.0])
    lit = restir.render(scene, samples=2, size=(12, 8))
    assert lit.color[..., 2].mean() > black.color[..., 2].mean()
    filled = restir.load("cube", subsurface="milk")
    assert not same(
        restir.render(filled, samples=2, size=(12, 8)), black
    )
