"""Errors a caller can act on; all derive from AffordanceError, whose text is always one line."""

from pathlib import Path


class AffordanceError(Exception):
    """Base of every error this package raises for what a user gave it or a file holds."""


class BadValueError(AffordanceError):
    """A value in a file or on the command line is missing, of the wrong kind or out of bounds.

    Attributes:
        source: The file's path, or the command-line option.
        key: Where in the file, for example ``tools[2].components[0].semi_axes``; empty for the whole.
    """

    def __init__(self, source: Path | str, key: str, problem: str) -> None:
        """Joins the parts to ``source: key: problem``, on one line."""
        self.source = source
        self.key = key
        parts = [str(source), key, " ".join(problem.split())]
        super().__init__(": ".join(part for part in parts if part))


class ModelFileError(AffordanceError):
    """A robot description (SDF, URDF, directives) could not be loaded or lacks what an arm needs."""

    def __init__(self, path: Path | str, problem: str) -> None:
        """Joins path and problem on one line."""
        self.path = path
        super().__init__(f"{path}: {' '.join(problem.split())}")
