"""Reads recordings (.rrd) of single runs.

A recording consists of chunks: Arrow tables with some rows of one entity. Chunks are not ordered by
time. A component has a value only in rows in which it was written; particles keep their materials
until these are written again.
"""

from __future__ import annotations

import warnings
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd
import pyarrow as pa
from rerun.experimental import RrdReader

from .errors import MissingFile, NotRecorded, UnreadableFile

FloatArray: TypeAlias = npt.NDArray[np.float64]

_PARTICLES = ("world/particles", "Points2D:positions")
_MATERIALS = ("world/particles", "Points2D:class_ids")
_STRIPS = "LineStrips2D:strips"

# Recordings contain no units.
_UNITS = {
    "speed": "m/s",
    "rotation": "1/s",
    "pressure": "Pa",
    "alignment": "",
    "inertial_number": "",
    "yielded": "",
}


@dataclass(frozen=True, eq=False)
class Field:
    """A field on a regular grid of cells that cover the domain."""

    name: str
    """Name of the field."""
    unit: str
    """SI unit; empty if the field has none, `?` if this package does not know the field."""
    time: float
    """Simulated time (s)."""
    x: FloatArray
    """Coordinates of the cell centres along x (m), shape (nx,)."""
    y: FloatArray
    """Coordinates of the cell centres along y (m), shape (ny,)."""
    values: FloatArray
    """Values in `unit`, shape (ny, nx); NaN where there is no value."""


class _Row(NamedTuple):
    time: float
    """Simulated time (s)."""
    wall: float
    """Computing time so far (s)."""
    value: Any
    """Arrow scalar: the list of the values of a component."""


class Recording:
    """An open recording. Each component is read when it is first needed, for all frames."""

    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise MissingFile(path, "there is no such recording")
        self.path = path
        try:
            with warnings.catch_warnings():
                # A file without its end causes a warning about its age before the error.
                warnings.simplefilter("ignore")
                self._store = RrdReader(path).store()
        except (RuntimeError, ValueError) as error:
            raise self._unreadable() from error
        paths = self._store.schema().entity_paths()
        runs = {path.split("/")[2] for path in paths if path.startswith("/runs/")}
        if len(runs) != 1:
            raise UnreadableFile(path, f"holds {len(runs)} runs of grainscope instead of one")
        self._root = f"/runs/{runs.pop()}"
        fields, values = f"{self._root}/world/fields/", "/values"
        self.field_names = [
            path.removeprefix(fields).removesuffix(values)
            for path in paths
            if path.startswith(fields) and path.endswith(values)
        ]
        self._cache: dict[tuple[str, str], dict[int, _Row]] = {}

    @cached_property
    def scene(self) -> str:
        """The resolved scene, as TOML."""
        fenced: str = self._constant("scene", "TextDocument:text")[0].as_py()
        return "\n".join(fenced.rstrip().split("\n")[1:-1])

    @cached_property
    def materials(self) -> list[str]:
        """Names of the materials; the class of a particle is an index into them."""
        classes = self._constant("world", "AnnotationContext:context")[0].as_py()
        return [entry["class_description"]["info"]["label"] for entry in classes]

    @cached_property
    def frames(self) -> pd.DataFrame:
        """Step and times of each frame."""
        rows = self._rows(*_PARTICLES)
        table = pd.DataFrame(
            [(step, row.time, row.wall) for step, row in rows.items()],
            columns=["step", "time", "wall"],
        )
        return table.rename_axis(index="frame")

    def particles(self, frame: int) -> pd.DataFrame:
        """Positions (m) and materials of the particles of a frame."""
        step = self._step(frame)
        x, y = _points(self._rows(*_PARTICLES)[step].value.values).T
        classes = self._rows(*_MATERIALS)
        written = list(classes)
        last = written[bisect_right(written, step) - 1]
        material = pd.Categorical.from_codes(
            classes[last].value.values.to_numpy(), categories=pd.Index(self.materials)
        )
        return pd.DataFrame({"x": x, "y": y, "material": material})

    def lines(self, entity: str, frame: int) -> list[FloatArray]:
        """Points (m) of the lines of an entity in a frame."""
        return _strips(self._at(entity, _STRIPS, frame).value.values)

    @cached_property
    def walls(self) -> list[tuple[str, FloatArray]]:
        """Names and points (m) of the walls."""
        names = self._constant("world/walls", "LineStrips2D:labels").to_pylist()
        return list(zip(names, _strips(self._constant("world/walls", _STRIPS)), strict=True))

    def field(self, name: str, frame: int) -> Field:
        """A field in a frame."""
        if name not in self.field_names:
            known = ", ".join(self.field_names) or "none"
            raise NotRecorded(f"{self.path}: there is no field {name!r}; recorded are: {known}")
        row = self._at(f"world/fields/{name}/values", "Tensor:data", frame)
        tensor = row.value.values[0]
        values = tensor["buffer"].value.values.to_numpy().astype(np.float64)
        ny, nx = tensor["shape"].as_py()
        (x0, y0), (width, height) = self._domain
        return Field(
            name=name,
            unit=_UNITS.get(name, "?"),
            time=row.time,
            x=x0 + width * (np.arange(nx) + 0.5) / nx,
            y=y0 + height * (np.arange(ny) + 0.5) / ny,
            values=values.reshape(ny, nx),
        )

    @cached_property
    def _domain(self) -> tuple[FloatArray, FloatArray]:
        """Lower left corner and size of the domain (m), from the picture of a field."""
        picture = f"world/fields/{self.field_names[0]}/image"
        origin, pixel, image = (
            self._constant(picture, component)[0].as_py()
            for component in ("Transform3D:translation", "Transform3D:scale", "Image:format")
        )
        pixels = [image["width"], image["height"]]
        return np.array(origin[:2]), np.multiply(pixel[:2], pixels)

    def _step(self, frame: int) -> int:
        steps = list(self._rows(*_PARTICLES))
        try:
            return steps[frame]
        except IndexError:
            raise NotRecorded(
                f"{self.path}: there is no frame {frame}; it has {len(steps)} frames"
            ) from None

    def _at(self, entity: str, component: str, frame: int) -> _Row:
        try:
            return self._rows(entity, component)[self._step(frame)]
        except KeyError:
            raise NotRecorded(f"{self.path}: frame {frame} has no {entity}") from None

    def _rows(self, entity: str, component: str) -> dict[int, _Row]:
        """Rows in which a component was written, by the number of the step, in order."""
        key = (entity, component)
        if key not in self._cache:
            rows = {}
            for chunk in self._chunks(entity, component):
                steps = chunk["step"].to_pylist()
                times, walls = (
                    chunk[timeline].cast(pa.int64()).to_numpy() / 1e9
                    for timeline in ("sim_time", "wall_time")
                )
                for step, time, wall, value in zip(
                    steps, times.tolist(), walls.tolist(), chunk[component], strict=True
                ):
                    if value.is_valid:
                        rows[step] = _Row(time, wall, value)
            self._cache[key] = dict(sorted(rows.items()))
        return self._cache[key]

    def _constant(self, entity: str, component: str) -> Any:
        """Values of a component that does not change, as an Arrow array."""
        chunk = next(self._chunks(entity, component), None)
        if chunk is None:
            raise self._unreadable()
        return chunk[component][0].values

    def _chunks(self, entity: str, component: str) -> Iterator[Any]:
        """Arrow tables with a component of an entity below the run."""
        chunks = self._store.stream().filter(content=f"{self._root}/{entity}", components=component)
        try:
            for chunk in chunks:
                yield chunk.to_record_batch()
        except RuntimeError as error:
            raise self._unreadable() from error

    def _unreadable(self) -> UnreadableFile:
        return UnreadableFile(
            self.path,
            "is no complete recording: its run has not ended or was killed, or the file is "
            f"damaged; `grainscope repair {self.path}` mends what can be mended",
        )


def _points(points: Any) -> FloatArray:
    """Points as an array of shape (n, 2)."""
    coordinates: FloatArray = points.flatten().to_numpy().astype(np.float64)
    return coordinates.reshape(-1, 2)


def _strips(strips: Any) -> list[FloatArray]:
    return [_points(strip.values) for strip in strips]
