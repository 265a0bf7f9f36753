"""Reads XML, with errors that name file, element and value."""

import math
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import SHAPES
from affordance.files import xml_file as files
from affordance.files.bounded import ROBOT
from affordance.files.constraints import check_names


def read_xml(path: Path, content: bytes | None = None) -> Element:
    """Parses a robot's XML file, or its content. Oversized files and entities are rejected."""
    root = files.read_xml(path, ROBOT) if content is None else files.parse_xml(path, content)
    check_names(path, "name", (element.get("name", "") for element in root.iter()))
    return root


@dataclass(frozen=True)
class Numbers:
    """Parser of numbers in a file, with errors that name the file."""

    path: Path

    def parse(self, text: str | None, key: str, count: int, default: Iterable[float]) -> tuple[float, ...]:
        """Parses ``count`` finite numbers. None gives the default; any other text raises a BadValueError."""
        if text is None or not text.strip():
            return tuple(default)
        try:
            values = tuple(float(word) for word in text.split())
        except ValueError:
            values = ()
        if len(values) != count or not all(math.isfinite(value) for value in values):
            wanted = "a finite number" if count == 1 else f"{count} finite numbers"
            raise BadValueError(self.path, key, f"is {' '.join(text.split())[:60]!r}, must be {wanted}")
        return values

    def parse_one(self, text: str | None, key: str, default: float) -> float:
        """Parses one finite number, as in ``parse``."""
        return self.parse(text, key, 1, (default,))[0]

    def parse_sizes(self, shape: str, find: Callable[[str], str | None], key: str) -> tuple[float, ...]:
        """Parses a mesh's scale (default 1) or a simple shape's sizes (default 1 cm). Empty for other shapes."""
        names, default = (("scale",), 1.0) if shape == "mesh" else (SHAPES.get(shape, ()), 0.01)
        sizes: tuple[float, ...] = ()
        for name in names:
            count = 3 if name in ("size", "radii", "scale") else 1
            sizes += self.parse(find(name), f"{key}.{shape}.{name}", count, (default,) * count)
        return sizes if shape == "mesh" or all(size > 0.0 for size in sizes) else ()

    def parse_bound(self, text: str | None, key: str) -> float | None:
        """Parses a number that may be infinite. Returns None if absent; other text raises a BadValueError."""
        if text is None or not text.strip():
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isnan(value):
            raise BadValueError(self.path, key, f"is {text.strip()[:60]!r}, must be a number")
        return value


def find_text(element: Element, path: str) -> str | None:
    """Returns the text of a descendant of an element, or None."""
    found = element.find(path)
    return None if found is None else found.text


def get_attribute(element: Element | None, name: str) -> str | None:
    """Returns an attribute of an element, or None if the attribute or the element is missing."""
    return None if element is None else element.get(name)


def remove_children(element: Element, unwanted: Iterable[str]) -> None:
    """Removes the children with unwanted tags."""
    for tag in unwanted:
        for child in element.findall(tag):
            element.remove(child)


def list_new(
    elements: Iterable[Element], path: Path, known: Container[str], scope: str = ""
) -> Iterator[tuple[Element, str, str]]:
    """Yields links or joints, each with its scoped name and its key for messages.

    Raises:
        BadValueError: A name is missing or already used.
    """
    for element in elements:
        short = name_of(element, path)
        if f"{scope}{short}" in known:
            raise BadValueError(path, f"{element.tag} {short}", "appears twice")
        yield element, f"{scope}{short}", f"{element.tag} {short}"


def name_of(element: Element, path: Path) -> str:
    """Returns the name of a link or joint. A missing name raises a BadValueError."""
    name = element.get("name")
    if not name:
        raise BadValueError(path, element.tag, "has no name")
    return name
