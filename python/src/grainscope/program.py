"""Runs scenes with the program."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping
from fractions import Fraction
from typing import TypeAlias

from .errors import ProgramNotFound, RunFailed
from .results import Run, StrPath, load

Setting: TypeAlias = bool | int | float | Fraction | str
"""Value of a parameter or key of a scene: a number, or text such as `"5/3"` or `"regular"`."""


def run(
    scene: StrPath,
    *,
    out: StrPath | None = None,
    program: StrPath | None = None,
    force: bool = False,
    set: Mapping[str, Setting] | None = None,
    **sets: Setting,
) -> Run:
    """Run a scene, wait for its end, and open the results.

    An interrupt (Ctrl-C) ends the run after the current step; its folder can be loaded.

    Parameters
    ----------
    scene : name of a preset, or path of a scene file (TOML).
    out : folder of the run; by default `runs/<name of the scene>`, numbered if that exists.
    program : path of the program; by default the environment variable `GRAINSCOPE`, or else
        `grainscope` on the `PATH`.
    force : replace a run that is already in the folder.
    set : values of keys, for example `{"accuracy.cells": 2}`, in SI units.
    **sets : values of parameters of the scene, for example `alpha=0`, in SI units.

    Raises
    ------
    ProgramNotFound : there is no such program.
    RunFailed : the program ended with an error.
    """
    command = [_find(program), "run", os.fspath(scene), "--json"]
    if out is not None:
        command += ["--out", os.fspath(out)]
    if force:
        command.append("--force")
    for key, value in {**(set or {}), **sets}.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        command += ["--set", f"{key}={text}"]
    summary = json.loads(_output(command))
    return load(summary["folder"] if out is None else out)


def _find(program: StrPath | None) -> str:
    wanted = os.fspath(program or os.environ.get("GRAINSCOPE") or "grainscope")
    found = shutil.which(wanted)
    if found is None:
        raise ProgramNotFound(
            f"there is no program {wanted!r}; build it with `cargo build --release`, and give "
            "target/release/grainscope as `program` or in the environment variable GRAINSCOPE"
        )
    return found


def _output(command: list[str]) -> str:
    """What a command writes to stdout."""
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        # A second interrupt would end the program at once, so it gets none from the terminal.
        start_new_session=True,
    ) as process:
        try:
            output, message = process.communicate()
        except KeyboardInterrupt:
            process.terminate()
            process.wait()
            raise
    if process.returncode != 0:
        raise RunFailed(process.returncode, message.strip())
    return output
