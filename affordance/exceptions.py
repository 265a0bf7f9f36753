"""Errors a caller can act on; all derive from AffordanceError, whose text is always one line."""

from pathlib import Path


class AffordanceError(Exception):
    """Base of every error this package raises for what a user gave it or a file holds."""


class BadValueError(AffordanceError):
    """A value in a file or on the command line is missing, of the wrong kind or out of bounds.

    Attributes:
        source: The file's path, or the command-line option.
        key: Where in the file, for example ``tools[2].components[0].semi_axes``; empty for the whole.
        problem: What the value is, and the bound it breaks.
    """

    def __init__(self, source: Path | str, key: str, problem: str) -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(source, key, problem)
        self.source = source
        self.key = key
        self.problem = problem

    def __str__(self) -> str:
        return _on_one_line(": ".join(part for part in (str(self.source), self.key, self.problem) if part))


class ModelFileError(AffordanceError):
    """A robot description (SDF, URDF, directives) could not be loaded or lacks what an arm needs.

    Attributes:
        path: The file.
        problem: What is wrong with it.
    """

    def __init__(self, path: Path | str, problem: str) -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(path, problem)
        self.path = path
        self.problem = problem

    def __str__(self) -> str:
        return _on_one_line(f"{self.path}: {self.problem}")


def _on_one_line(text: str) -> str:
    return " ".join(text.split())
