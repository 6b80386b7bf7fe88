"""Run grainscope and read its results.

All values are in SI units of a two-dimensional scene: per metre of depth, with y up.
"""

from importlib.metadata import version

from .errors import (
    GrainscopeError,
    MissingFile,
    NotRecorded,
    ProgramNotFound,
    RunFailed,
    UnreadableFile,
)
from .program import Setting, run
from .recording import Field, FloatArray
from .results import Run, load

__version__ = version("grainscope")

__all__ = [
    "Field",
    "FloatArray",
    "GrainscopeError",
    "MissingFile",
    "NotRecorded",
    "ProgramNotFound",
    "Run",
    "RunFailed",
    "Setting",
    "UnreadableFile",
    "load",
    "run",
]
