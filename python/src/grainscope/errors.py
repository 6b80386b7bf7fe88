"""Errors of this package. All are subclasses of `GrainscopeError`."""

from pathlib import Path


class GrainscopeError(Exception):
    """Base class of all errors of this package."""


class _FileError(GrainscopeError):
    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(path, problem)
        self.path = path
        self.problem = problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}"


class MissingFile(_FileError):
    """A run, or one of its files, does not exist. `path` names it."""


class UnreadableFile(_FileError):
    """A file of a run is damaged or has other content than expected. `path` names it."""


class NotRecorded(GrainscopeError, LookupError):
    """The recording has no frame with this number, or no field with this name."""


class ProgramNotFound(GrainscopeError):
    """The program grainscope was not found."""


class RunFailed(GrainscopeError):
    """The program ended with an error.

    Attributes
    ----------
    exit_code : 1 a file or folder cannot be used or memory is too small, 2 usage error, 3 invalid
        scene, 4 not converged, 5 not finite, 130 interrupted; negative: ended by this signal.
    message : what the program wrote to stderr.
    """

    def __init__(self, exit_code: int, message: str) -> None:
        super().__init__(exit_code, message)
        self.exit_code = exit_code
        self.message = message

    def __str__(self) -> str:
        return f"grainscope ended with exit code {self.exit_code}:\n{self.message}"
