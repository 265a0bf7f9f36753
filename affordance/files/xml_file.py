"""Reads external XML; rejects entities, which could exhaust memory or include other files."""

from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from affordance.exceptions import PROSE, BadValueError, find_hidden
from affordance.files.bounded import read_bytes

# Largest numbers of levels and elements: a chain of a hundred nested bodies, and about ten elements per body.
_MOST_DEEP, _MOST_ELEMENTS = 200, 200_000


def read_xml(path: Path, most: int, parse: Callable[[bytes], Element] = ElementTree.fromstring) -> Element:
    """Reads an XML file of at most ``most`` bytes; ``parse`` is called after the checks.

    A file that is larger, is not XML, defines entities, or has too many elements raises a BadValueError.
    """
    return parse_xml(path, read_bytes(path, most), parse)


def parse_xml(path: Path, content: bytes, parse: Callable[[bytes], Element] = ElementTree.fromstring) -> Element:
    """Parses XML from bytes; ``parse`` is called after the checks, and errors are those of ``read_xml``."""
    try:
        check_xml(content, path)
        return parse(content)
    except (ElementTree.ParseError, expat.ExpatError) as error:
        line, column = error.position if isinstance(error, ElementTree.ParseError) else (error.lineno, error.offset)
        problem = str(error).split(":")[0]
        raise BadValueError(path, f"line {line}, column {column + 1}", f"is not XML: {problem}") from error
    except (LookupError, ValueError) as error:
        raise BadValueError(path, "", f"is not XML: {error}") from error


def check_xml(content: bytes, path: Path) -> None:
    """Checks that XML has no entities, and neither too many nor too deeply nested elements.

    Raises:
        BadValueError: A check failed; the message names the line.
        ExpatError: The XML is invalid.
        LookupError, ValueError: The encoding is unknown.
    """
    parser = expat.ParserCreate()
    depth = elements = 0

    def refuse(problem: str) -> BadValueError:
        return BadValueError(path, f"line {parser.CurrentLineNumber}", problem)

    def begin(_: str, attributes: Mapping[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if depth > _MOST_DEEP:
            raise refuse(f"is more than {_MOST_DEEP} elements deep")
        if elements > _MOST_ELEMENTS:
            raise refuse(f"has more than {_MOST_ELEMENTS} elements")
        for name, value in attributes.items():
            if hidden := find_hidden(value, PROSE):
                raise refuse(f"has the attribute {name} with {hidden}")

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1

    def declare(name: str, *_: object) -> None:
        raise refuse(f"defines the entity {name!r}, must be expanded")

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.EntityDeclHandler = declare
    parser.Parse(content, True)
