"""The job template renders a turntable in parts and merges it: the frames are those of one render."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import restir
from conftest import REPOSITORY, same

pytest.importorskip("openjd.cli")

FRAMES, SAMPLES = 3, 11


def test_a_turntable_is_rendered_in_parts_and_merged(program, tmp_path):
    if "RESTIR_PROGRAM" not in os.environ:
        program("scenes")
    built = os.environ.get("RESTIR_PROGRAM", str(REPOSITORY / "target/release/restir"))
    given = {
        "Scene": "statue",
        "Folder": tmp_path / "farm",
        "LastFrame": FRAMES - 1,
        "LastSample": SAMPLES - 1,
        "SamplesPerTask": 4,
        "Size": "32x24",
        "Options": "--device cpu",
        "Program": built,
    }
    parameters = [word for key, value in given.items() for word in ("-p", f"{key}={value}")]
    openjd = Path(sys.executable).with_name("openjd")
    template = REPOSITORY / "farm/restir.openjd.yaml"
    command = [openjd, "run", template, "--step", "Merge", "--run-dependencies", *parameters]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    whole = ["--turntable", str(FRAMES), "--spp", str(SAMPLES), "--size", "32x24", "--device", "cpu"]
    program("render", "statue", *whole, "-o", str(tmp_path / "####.exr"))
    for frame in range(FRAMES):
        name = f"{frame:04}.exr"
        assert same(restir.read(tmp_path / "farm" / name), restir.read(tmp_path / name)), name
    assert len(list((tmp_path / "farm/parts-4-10").iterdir())) == 3 * FRAMES
