"""Reading XML so that every mistake is named by file, element and value."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from affordance.exceptions import BadValueError
from affordance.files import xml_file as files
from affordance.files.bounded import ROBOT
from affordance.robots.undeclared import parse_undeclared


def read_xml(path: Path) -> Element:
    """Reads a robot's file.

    Raises:
        BadValueError: It cannot be read, is too large, is not XML, or defines entities.
    """
    return files.read_xml(path, ROBOT, _parse)


def _parse(content: bytes) -> Element:
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        if error.code != expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX]:
            raise
        return parse_undeclared(content)


class Numbers:
    """Takes numbers out of a file's text, and names the place of what is none."""

    def __init__(self, path: Path) -> None:
        """Takes the file that errors name."""
        self._path = path

    def parse(self, text: str | None, key: str, count: int, default: Iterable[float]) -> tuple[float, ...]:
        """Parses numbers.

        Args:
            text: The text; None or empty for none.
            key: Where it stands in the file.
            count: How many there must be.
            default: What an absent text stands for.

        Raises:
            BadValueError: It is not so many finite numbers.
        """
        if text is None or not text.strip():
            return tuple(default)
        try:
            values = tuple(float(word) for word in text.split())
        except ValueError:
            values = ()
        if len(values) != count or not all(math.isfinite(value) for value in values):
            wanted = "a finite number" if count == 1 else f"{count} finite numbers"
            raise BadValueError(self._path, key, f"is {' '.join(text.split())[:60]!r}, must be {wanted}")
        return values

    def parse_one(self, text: str | None, key: str, default: float) -> float:
        """Parses one finite number; arguments and errors as of ``parse``."""
        return self.parse(text, key, 1, (default,))[0]

    def refuse(self, key: str, problem: str) -> NoReturn:
        """Rejects what stands at a place of the file.

        Raises:
            BadValueError: Always.
        """
        raise BadValueError(self._path, key, problem)

    def parse_bound(self, text: str | None, key: str) -> float | None:
        """Parses a number that may be infinite; None if it is absent.

        Raises:
            BadValueError: It is not a number.
        """
        if text is None or not text.strip():
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isnan(value):
            raise BadValueError(self._path, key, f"is {text.strip()[:60]!r}, must be a number")
        return value


def find_text(element: Element, path: str) -> str | None:
    """The text of an element below another; None if there is none."""
    found = element.find(path)
    return None if found is None else found.text


def get_attribute(element: Element | None, name: str) -> str | None:
    """An attribute of an element that may be absent."""
    return None if element is None else element.get(name)


def remove_children(element: Element, unwanted: Iterable[str]) -> None:
    """Removes the children of certain tags."""
    for tag in unwanted:
        for child in element.findall(tag):
            element.remove(child)


def name_of(element: Element, path: Path) -> str:
    """The name of a link or joint.

    Raises:
        BadValueError: It has none.
    """
    name = element.get("name")
    if not name:
        raise BadValueError(path, element.tag, "has no name")
    return name
