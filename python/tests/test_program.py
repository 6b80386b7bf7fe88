"""The program is found, gets its arguments, and its errors are passed on."""

import os
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import pytest
from conftest import SHORT

import grainscope


@pytest.fixture(autouse=True)
def in_an_empty_folder(program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAINSCOPE", program)
    monkeypatch.chdir(tmp_path)


def test_settings_reach_the_scene() -> None:
    settings = {**SHORT, "materials.background.background": True}
    run = grainscope.run("silo", set=settings, alpha=Fraction(5, 3), fill_height=6)
    assert run.path == Path("runs/silo")
    parameters = run.scene["parameters"]
    assert (parameters["alpha"]["value"], parameters["fill_height"]["value"]) == ("5/3", 6)
    assert run.scene["accuracy"]["cells"] == 1


def test_folders_are_numbered_or_replaced_on_demand() -> None:
    for folder in ("runs/silo", "runs/silo-2"):
        assert grainscope.run("silo", set=SHORT).path == Path(folder)
    with pytest.raises(grainscope.RunFailed, match="already holds a run; --force overwrites it"):
        grainscope.run("silo", out="runs/silo", set=SHORT)
    again = grainscope.run("silo", out="runs/silo", force=True, set=SHORT)
    assert again.summary["state_hash"] == grainscope.load("runs/silo-2").summary["state_hash"]


def test_a_scene_file_is_run() -> None:
    first = grainscope.run("silo", set=SHORT, alpha=1)
    second = grainscope.run(first.path / "scene.toml", out="again")
    assert second.summary["state_hash"] == first.summary["state_hash"]


@pytest.mark.parametrize(
    ("scene", "alpha", "code", "message"),
    [("silo", -5, 3, "outside its range"), ("sillo", 0, 3, "sillo"), ("--no", 0, 2, "--no")],
)
def test_a_scene_that_cannot_run(scene: str, alpha: int, code: int, message: str) -> None:
    with pytest.raises(grainscope.RunFailed, match=message) as caught:
        grainscope.run(scene, alpha=alpha)
    assert caught.value.exit_code == code
    assert not Path("runs").exists()


def test_the_program_is_found_by_argument_environment_and_path(
    program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("grainscope").symlink_to(program)
    monkeypatch.setenv("PATH", ".")
    monkeypatch.delenv("GRAINSCOPE")
    grainscope.run("silo", set=SHORT)
    monkeypatch.setenv("GRAINSCOPE", "nowhere")
    with pytest.raises(grainscope.ProgramNotFound, match=r"'nowhere'.*cargo build.*GRAINSCOPE"):
        grainscope.run("silo")
    grainscope.run("silo", program=program, set=SHORT)


def test_an_interrupt_ends_the_run_after_the_step() -> None:
    code = "import grainscope; grainscope.run('silo', out='run', set={'accuracy.cells': 4})"
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True) as process:
        while not Path("run/series.csv").exists():
            assert process.poll() is None
            time.sleep(0.05)
        # As a terminal does on Ctrl-C: the signal goes to all processes of the group.
        os.killpg(process.pid, signal.SIGINT)
        _, message = process.communicate(timeout=20)
    assert b"KeyboardInterrupt" in message
    run = grainscope.load("run")
    assert run.summary["ending"] == "interrupted"
    assert len(run.frames) > 0
