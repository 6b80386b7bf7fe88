"""Runs that several tests read. The program is `GRAINSCOPE` or on the PATH."""

import os
import shutil
from pathlib import Path

import pytest

import grainscope

COARSE: dict[str, grainscope.Setting] = {"accuracy.cells": 2, "recording.frames": 10}
SHORT: dict[str, grainscope.Setting] = {
    "accuracy.cells": 1,
    "recording.frames": 2,
    "recording.times": "[]",
    "time.end": 1e-5,
}


@pytest.fixture(scope="session")
def program() -> str:
    """Absolute path of the program."""
    found = shutil.which(os.environ.get("GRAINSCOPE", "grainscope"))
    assert found, "set GRAINSCOPE to the path of the program"
    return str(Path(found).absolute())


@pytest.fixture(scope="session")
def silo(program: str, tmp_path_factory: pytest.TempPathFactory) -> grainscope.Run:
    """A coarse silo. The name of its folder has characters that Rerun escapes."""
    out = tmp_path_factory.mktemp("runs") / "a sîlo"
    return grainscope.run("silo", program=program, out=out, set=COARSE)


@pytest.fixture(scope="session")
def layered(program: str, tmp_path_factory: pytest.TempPathFactory) -> grainscope.Run:
    """A scene with directors. Its particles keep their materials, which are recorded once."""
    out = tmp_path_factory.mktemp("runs") / "layered"
    return grainscope.run("silo_pencils", program=program, out=out, set=SHORT)


@pytest.fixture
def copy(silo: grainscope.Run, tmp_path: Path) -> Path:
    """A folder with links to the files of the silo, which a test may remove or replace."""
    for file in silo.path.iterdir():
        (tmp_path / file.name).symlink_to(file)
    return tmp_path
