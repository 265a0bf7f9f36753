"""Errors a caller can act on; all derive from AffordanceError, whose text is always one line."""

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

# Letters of a value, and of a whole message, that are shown.
_SHOWN, _LONGEST = 100, 2000
# Words that stand where an article would.
_DETERMINERS = {"the", "a", "an", "my", "your", "our", "his", "her", "its", "their", "this", "that"}


class AffordanceError(Exception):
    """Base of every error this package raises for what a user gave it or a file holds."""

    def __str__(self) -> str:
        return _on_one_line(super().__str__())


def describe_choice(value: object, known: Iterable[str]) -> str:
    """Says that a value is none of the known names, and which of them is nearest."""
    names = list(known)
    near = difflib.get_close_matches(str(value)[:_SHOWN], names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    shown = repr(value) if len(repr(value)) <= _SHOWN else f"{repr(value)[:_SHOWN]}..."
    return f"is {shown}, must be one of {', '.join(names)}{hint}"


def name_object(name: str) -> str:
    """Names an object within a sentence: "the stick", but "my hammer"."""
    return name if name.split(" ", 1)[0].lower() in _DETERMINERS else f"the {name}"


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


class BadArgumentError(BadValueError, ValueError):
    """An argument of a public function is of the wrong kind or out of bounds; ``arguments`` raises it.

    Attributes:
        source: Name of the argument, or of the class whose field it is.
        key: Where in the argument; empty for the whole.
        problem: Description of the value and the bound that it breaks.
    """


class InfeasibleError(BadValueError):
    """A task that an arm cannot do, though nothing is wrong with the files that ask for it."""


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


class UnavailableError(AffordanceError):
    """A part of the program that does not work on this machine, as something optional is missing.

    Attributes:
        part: What does not work.
        problem: What is missing, in the words of who missed it.
    """

    def __init__(self, part: str, problem: str) -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(part, problem)
        self.part = part
        self.problem = problem

    def __str__(self) -> str:
        return _on_one_line(f"{self.part} unavailable here ({self.problem}); affordance doctor says how to get it")


class NoPlanError(AffordanceError):
    """A controller that finds no motion within position and velocity limits.

    Attributes:
        time: When, since the motion began, [s].
        place: Where that is, in words; empty if it is not known.
    """

    def __init__(self, time: float, place: str = "") -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(time, place)
        self.time = time
        self.place = place

    def __str__(self) -> str:
        near = f", near {self.place}" if self.place else ""
        return _on_one_line(f"no plan keeps the joints' position and velocity limits at t = {self.time:.3f} s{near}")


class StallError(AffordanceError):
    """A simulation whose integrator takes so many steps that it would not end.

    Attributes:
        tool: Name of the tool.
        time: How far it came, [s].
        num_steps: The most steps there may be.
        touches: Names of the bodies that touch then, in pairs.
    """

    def __init__(self, tool: str, time: float, num_steps: int, touches: tuple[tuple[str, str], ...]) -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(tool, time, num_steps, touches)
        self.tool = tool
        self.time = time
        self.num_steps = num_steps
        self.touches = touches

    def __str__(self) -> str:
        touching = " and ".join(f"{one} on {other}" for one, other in self.touches) or "nothing touching"
        problem = f"stalls at t = {self.time:.4f} s with {touching}, must take at most {self.num_steps} steps"
        return _on_one_line(f"the simulated blow with {name_object(self.tool)} {problem}")


class SeeingError(AffordanceError):
    """A picture in which the features of an object cannot be detected.

    Attributes:
        reason: What is the matter, with the number and its bound.
        colour: The picture, red, green and blue, shape (height, width, 3), uint8, for inspection.
        depth: Its depth, shape (height, width), [m].
        frame: Where the picture was saved; empty if it was not.
    """

    def __init__(self, reason: str, colour: NDArray[Any], depth: NDArray[Any], frame: str = "") -> None:
        """Keeps its parts as arguments, so that it survives the way from one process to another."""
        super().__init__(reason, colour, depth, frame)
        self.reason = reason
        self.colour = colour
        self.depth = depth
        self.frame = frame

    def __str__(self) -> str:
        saved = f" (picture saved as {self.frame})" if self.frame else ""
        return _on_one_line(f"{self.reason}{saved}")


class UnusablePictureError(SeeingError):
    """The picture is none: of the wrong shape or kind, or smaller than what the smallest object covers."""


class NoDepthError(SeeingError):
    """There is no depth reading, or too few, or none that is a number."""


class OneColourError(SeeingError):
    """The whole picture is of one colour, as that of a camera that is covered or broken."""


class NothingSeenError(SeeingError):
    """There is nothing on the stand: no object, or it is out of view."""


class OutOfViewError(SeeingError):
    """The object reaches beyond the picture's edge."""


class TooSmallError(SeeingError):
    """A part covers fewer pixels than its fit needs."""


class HiddenPartError(SeeingError):
    """One part stands before another, so that too little of that one is visible."""


class NoFitError(SeeingError):
    """No ellipsoid of a plausible size fits what is visible of a part."""


def _on_one_line(text: str) -> str:
    """Such that a terminal shows one line of it, of bearable length, and does nothing else."""
    line = "".join(letter if letter.isprintable() else "\ufffd" for letter in " ".join(text.split()))
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 2 :]}"
