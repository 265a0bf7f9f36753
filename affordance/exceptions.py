"""Errors that callers can handle. All derive from AffordanceError and have a message of one line."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray  # importing NumPy would take a third of the time of --help

# Largest number of characters in a shown value, and in a whole message.
_SHOWN, _LONGEST = 100, 2000
# Characters that are allowed in texts of several lines, although Python considers them not printable.
PROSE = "\n\t\u00a0\u2009\u202f\u3000"
# First words of names that need no additional article.
_DETERMINERS = {"the", "a", "an", "my", "your", "our", "his", "her", "its", "their", "this", "that"}


class AffordanceError(Exception):
    """Base class of all errors that this package raises for user input or file contents.

    Example:
        >>> from affordance import AffordanceError, load_tools
        >>> try:
        ...     load_tools("my_tools.yaml")
        ... except AffordanceError as error:
        ...     print(error)
        my_tools.yaml: cannot be read: No such file or directory
    """

    def __str__(self) -> str:
        return _on_one_line(super().__str__())

    def __post_init__(self) -> None:
        # Errors that are dataclasses need ``args`` to be pickled between processes.
        self.args = tuple(getattr(self, each.name) for each in fields(self))  # type: ignore[arg-type]


def find_hidden(text: str, allowed: str = "") -> str:
    """Describes a text's first character that is neither printable nor allowed; empty if there is none."""
    hidden = (each for each in text if not each.isprintable() and each not in allowed)
    return next((f"the hidden character U+{ord(each):04X}" for each in hidden), "")


def show_text(text: str, allowed: str = "") -> str:
    """Replaces each character that is neither printable nor allowed with \ufffd."""
    return "".join(each if each.isprintable() or each in allowed else "\ufffd" for each in text)


def show_value(value: Any) -> str:
    """Formats a value in at most 60 characters."""
    if value is None:
        return "empty"
    try:
        text = repr(value)
    except ValueError:  # Python does not format integers of more than 4300 digits
        text = "an integer with thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def suggest(value: object, known: Iterable[str]) -> str:
    """Suggests known names that contain a value as a word, or else the most similar name.

    The result is empty if no name is similar.
    """
    word, names = str(value)[:_SHOWN], list(known)
    near = [name for name in names if word in name.split("_")] or difflib.get_close_matches(word, names, n=1)
    return f"; did you mean {' or '.join(map(repr, near[:3]))}?" if near else ""


def describe_choice(value: object, known: Iterable[str]) -> str:
    """Describes an unknown value, and suggests the most similar known name."""
    names = list(known)
    shown = repr(value) if len(repr(value)) <= _SHOWN else f"{repr(value)[:_SHOWN]}..."
    return f"is {shown}, must be one of {', '.join(names)}{suggest(value, names)}"


def name_object(name: str) -> str:
    """Formats an object's name for use in a sentence: "the stick", but "my hammer"."""
    return name if name.split(" ", 1)[0].lower() in _DETERMINERS else f"the {name}"


def name_gripped(option: str) -> str:
    """Formats an option's name for use in a sentence: "mallet by head" becomes "the mallet by its head"."""
    name, _, grip = option.rpartition(" by ")
    if not name:
        return name_object(option)
    return f"{name_object(name)} {grip if grip.endswith('ed') else f'by its {grip}'}"


@dataclass(eq=False, repr=False)
class BadValueError(AffordanceError):
    """Error for a value in a file or on the command line that is missing, of the wrong type, or out of bounds.

    Attributes:
        source: Path of the file, or the command-line option.
        key: Key in the file, for example ``tools[2].components[0].semi_axes``; empty for the whole file.
        problem: Description of the value and of the bound that it violates.

    Example:
        >>> from affordance import BadValueError, Settings, change_settings
        >>> try:
        ...     change_settings(Settings(), {"prior.sd": -1})
        ... except BadValueError as error:
        ...     print(error)
        settings: prior.sd: is -1, must be from 0.001 to 1e+12
    """

    source: Path | str
    key: str
    problem: str

    def __str__(self) -> str:
        return _on_one_line(": ".join(part for part in (str(self.source), self.key, self.problem) if part))


class BadArgumentError(BadValueError, ValueError):
    """Error for an argument of a public function that is of the wrong type or out of bounds.

    Attributes:
        source: Name of the argument, or of the class to which the field belongs.
        key: Key in the argument; empty for the whole argument.
        problem: Description of the value and of the bound that it violates.

    Example:
        >>> from affordance import BadArgumentError, Prior
        >>> try:
        ...     Prior(sd=-1.0)
        ... except BadArgumentError as error:
        ...     print(error)
        Prior: sd: is -1.0, must be from 0.001 to 1e+12
    """


class InfeasibleError(BadValueError):
    """Error for a valid task that the arm cannot do."""


@dataclass(eq=False, repr=False)
class ModelFileError(AffordanceError):
    """Error for a robot description (SDF, URDF, Drake directives) that cannot be loaded or is incomplete.

    Attributes:
        path: Path of the file.
        problem: Description of the fault.

    Example:
        >>> from pathlib import Path
        >>> from affordance import ModelFileError, load_robot
        >>> _ = Path("robot.urdf").write_text('<robot name="robot"><link name="base"/></robot>')
        >>> try:
        ...     load_robot("robot.urdf", "base")
        ... except ModelFileError as error:
        ...     print(error)
        robot.urdf: has no joint that moves
    """

    path: Path | str
    problem: str

    def __str__(self) -> str:
        return _on_one_line(f"{self.path}: {self.problem}")


@dataclass(eq=False, repr=False)
class UnavailableError(AffordanceError):
    """Error for a feature that needs software missing on this machine.

    Attributes:
        part: Name of the feature with its verb, as in "rendered pictures are".
        problem: Reason why it is unavailable.
    """

    part: str
    problem: str

    def __str__(self) -> str:
        return _on_one_line(f"{self.part} unavailable here ({self.problem}); affordance doctor says how to get it")


@dataclass(eq=False, repr=False)
class NoPlanError(AffordanceError):
    """Error of a controller that finds no motion within position and velocity limits.

    Attributes:
        time: Time since the motion began, [s].
        place: Description of the place; empty if unknown.
    """

    time: float
    place: str = ""

    def __str__(self) -> str:
        near = f", near {self.place}" if self.place else ""
        return _on_one_line(f"no plan keeps the joints' position and velocity limits at t = {self.time:.3f} s{near}")


@dataclass(eq=False, repr=False)
class StallError(AffordanceError):
    """Error for a simulation that takes more than the allowed number of steps.

    Attributes:
        tool: Name of the tool.
        time: Simulated time, [s].
        num_steps: Allowed number of steps.
        touches: Pairs of names of bodies that are in contact.
    """

    tool: str
    time: float
    num_steps: int
    touches: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        touching = " and ".join(f"{one} on {other}" for one, other in self.touches) or "nothing touching"
        problem = f"stalls at t = {self.time:.4f} s with {touching}, must take at most {self.num_steps} steps"
        return _on_one_line(f"the simulated blow with {name_object(self.tool)} {problem}")


@dataclass(eq=False, repr=False)
class SeeingError(AffordanceError):
    """Error for a picture in which an object's features cannot be detected.

    Attributes:
        reason: Description of the fault.
        colour: Red, green and blue of the picture, (height, width, 3), uint8.
        depth: Depth of the picture, (height, width), [m].
        frame: Path of the saved picture; empty if it was not saved.
    """

    reason: str
    colour: "NDArray[Any]"
    depth: "NDArray[Any]"
    frame: str = ""

    def __str__(self) -> str:
        saved = f" (picture saved as {self.frame})" if self.frame else ""
        return _on_one_line(f"{self.reason}{saved}")


class UnusablePictureError(SeeingError):
    """Error for a picture of the wrong shape or type, or smaller than the smallest object."""


class NoDepthError(SeeingError):
    """Error for a picture with too few depth readings, or readings that are not finite."""


class OneColourError(SeeingError):
    """Error for a picture of a single colour, such as from a covered or broken camera."""


class NothingSeenError(SeeingError):
    """Error for a picture of an empty stand: there is no object, or it is out of view."""


class OutOfViewError(SeeingError):
    """Error for an object that extends beyond the picture's edge."""


class TooSmallError(SeeingError):
    """Error for a part that covers too few pixels to be fitted."""


class HiddenPartError(SeeingError):
    """Error for a part that is mostly hidden by another part."""


class NoFitError(SeeingError):
    """Error for a part whose visible surface does not fit any plausible ellipsoid."""


def _on_one_line(text: str) -> str:
    """Formats a text as a single line of limited length, without control characters."""
    line = show_text(" ".join(text.split()))
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 2 :]}"
