"""What the tests have in common."""

import os
import subprocess
from pathlib import Path

import pytest
import restir

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def cornell() -> restir.Scene:
    return restir.load("cornell")


@pytest.fixture(scope="session")
def program():
    """Runs the program, which RESTIR_PROGRAM names or cargo builds."""
    cargo = ["cargo", "run", "--locked", "--quiet", "--release", "--bin", "restir", "--"]
    command = [os.environ["RESTIR_PROGRAM"]] if "RESTIR_PROGRAM" in os.environ else cargo

    def run(*arguments: str) -> str:
        done = subprocess.run([*command, *arguments], cwd=REPOSITORY, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def same(image: object, other: object) -> bool:
    """Whether all values have the same bits."""
    return bool(restir.compare(image, other)["identical"])
