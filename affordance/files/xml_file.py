"""Reads external XML. Entities are rejected, because they can exhaust memory or include other files."""

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from affordance.exceptions import PROSE, BadValueError, find_hidden
from affordance.files.bounded import read_bytes


def read_xml(path: Path, most: int) -> Element:
    """Reads an XML file of at most ``most`` bytes.

    Raises:
        BadValueError: The file cannot be read, is too large, or is rejected by ``parse_xml``.
    """
    return parse_xml(path, read_bytes(path, most))


def parse_xml(path: Path, content: bytes) -> Element:
    """Parses XML from bytes. Prefixes need not be declared, and become namespaces: ``drake:x`` becomes ``{drake}x``.

    Raises:
        BadValueError: The XML is invalid, defines entities, or has hidden characters; the message names the line.
    """
    parser, tree = expat.ParserCreate(), TreeBuilder()
    parser.buffer_text = True

    def refuse(problem: str) -> BadValueError:
        return BadValueError(path, f"line {parser.CurrentLineNumber}", problem)

    def begin(tag: str, attributes: Mapping[str, str]) -> None:
        for name, value in attributes.items():
            if hidden := find_hidden(value, PROSE):
                raise refuse(f"has the attribute {name} with {hidden}")
        kept = {_qualify(name): value for name, value in attributes.items() if not name.startswith("xmlns")}
        tree.start(_qualify(tag), kept)

    def end(tag: str) -> None:
        tree.end(_qualify(tag))

    def declare(name: str, *_: object) -> None:
        raise refuse(f"defines the entity {name!r}, must be expanded")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = tree.data, declare
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        where = f"line {error.lineno}, column {error.offset + 1}"
        raise BadValueError(path, where, f"is not XML: {str(error).split(':')[0]}") from error
    except (LookupError, ValueError) as error:
        raise BadValueError(path, "", f"is not XML: {error}") from error
    return tree.close()


def _qualify(name: str) -> str:
    prefix, colon, rest = name.partition(":")
    return f"{{{prefix}}}{rest}" if colon else name
