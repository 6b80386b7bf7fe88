"""Opens runs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import pandas as pd

from .errors import MissingFile, UnreadableFile
from .recording import Field, FloatArray, Recording

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

StrPath: TypeAlias = str | os.PathLike[str]
_T = TypeVar("_T")

_RECORDING = "recording.rrd"
_SERIES = "series.csv"
_SUMMARY = "summary.json"


def load(path: StrPath) -> Run:
    """Open a run.

    Nothing is read until it is needed.

    Parameters
    ----------
    path : folder of a run, or a recording (`.rrd`). A `recording.rrd` in the folder of a run opens
        the folder; any other recording has no `series` and no `summary`.

    Raises
    ------
    MissingFile : there is no run at `path`.
    """
    path = Path(path)
    if path.suffix == ".rrd" and path.is_file():
        if path.name == _RECORDING and (path.parent / _SERIES).is_file():
            return Run(path.parent)
        return Run(path)
    if any((path / name).is_file() for name in (_SERIES, _SUMMARY, _RECORDING)):
        return Run(path)
    raise MissingFile(path, "holds no run; give the folder of a run, or a recording (.rrd)")


class Run:
    """Results of a run, read when they are first needed and then kept. `load` and `run` return it.

    A frame is a step whose particles and fields were recorded. Frames are numbered from 0; negative
    numbers count from the last frame.

    Attributes
    ----------
    path : folder of the run, or its recording.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

    @cached_property
    def series(self) -> pd.DataFrame:
        """The table `series.csv`: one row per step, in SI units.

        `grainscope columns` prints the unit and the meaning of each column.
        """
        return self._read(_SERIES, pd.read_csv)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Results at the end of the run, hashes and warnings: `summary.json`, in SI units."""
        return self._read(_SUMMARY, lambda file: dict(json.loads(file.read_bytes())))

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The resolved scene: `scene.toml`, or the scene in the recording if it is the only file.

        Numbers may be formulas, for example `"alpha * aperture"`.
        """
        if self.path.is_dir():
            return self._read("scene.toml", lambda file: tomllib.loads(file.read_text("utf-8")))
        return tomllib.loads(self._recording.scene)

    @property
    def frames(self) -> pd.DataFrame:
        """The recorded frames: one row per frame.

        Columns: `step` (number of the step: a value of `series.step`), `time` (s, a multiple of
        1 ns), `wall` (computing time so far, s).
        """
        return self._recording.frames

    def particles(self, frame: int) -> pd.DataFrame:
        """The particles of a frame: one row per particle.

        Columns: `x`, `y` (m, single precision), `material` (categorical). Dyed particles have the
        material `marked`. Background particles are not recorded, and of more than
        `scene["recording"]["max_particles"]` only every k-th one. Rows with the same number in two
        frames are not the same particle, because particles are split and merged.

        Raises
        ------
        MissingFile : the run has no recording.
        NotRecorded : there is no such frame.
        """
        return self._recording.particles(frame)

    @property
    def field_names(self) -> list[str]:
        """Names of the recorded fields: some of `speed`, `rotation`, `pressure`, `alignment`."""
        return self._recording.field_names

    def field(self, name: str, frame: int) -> Field:
        """A field of a frame, in single precision.

        Raises
        ------
        MissingFile : the run has no recording.
        NotRecorded : there is no such field or frame.
        """
        return self._recording.field(name, frame)

    def dye(self, frame: int) -> list[FloatArray]:
        """The dye lines of a frame: points (m) of shape (n, 2) for each line."""
        return self._recording.lines("world/dye", frame)

    def directors(self, frame: int) -> list[FloatArray]:
        """The director strokes of a frame: two end points (m), shape (2, 2), for each stroke."""
        return self._recording.lines("world/directors", frame)

    @property
    def walls(self) -> list[tuple[str, FloatArray]]:
        """Names of the walls and of the sides of the domain, and their points (m), shape (n, 2).

        Periodic sides are left out. The sides of a block have the name of the block.
        """
        return self._recording.walls

    @cached_property
    def _recording(self) -> Recording:
        if not self.path.is_dir():
            return Recording(self.path)
        path = self.path / _RECORDING
        if not path.is_file() and (self.path / _SUMMARY).is_file():
            # `grainscope run --save` writes the recording elsewhere.
            path = Path(self.summary.get("recording", path))
        if not path.is_file():
            raise MissingFile(
                path, "the run has no recording; run the scene again without --no-recording"
            )
        return Recording(path)

    def _read(self, name: str, parse: Callable[[Path], _T]) -> _T:
        """Reads a file of the folder."""
        if not self.path.is_dir():
            raise MissingFile(self.path, f"a recording has no {name}; load the folder of the run")
        file = self.path / name
        try:
            return parse(file)
        except FileNotFoundError:
            raise MissingFile(file, "does not exist: the run was killed or has not ended") from None
        except (OSError, TypeError, ValueError) as error:
            raise UnreadableFile(
                file, f"{error}; `grainscope repair {self.path}` mends what can be mended"
            ) from error
