"""Parser for XML with undeclared prefixes, which simulators' own elements in a robot's file often have."""

from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

# Prefixes that are part of XML itself.
_DECLARED = ("xml", "xmlns")
_NAMESPACE = "undeclared:"


def parse_undeclared(content: bytes) -> Element:
    """Parses XML after declaring every undeclared prefix in its root element.

    Raises:
        ParseError: The XML has other errors too.
    """
    used, declared, place = list[str](), set[str](), list[int]()
    parser = expat.ParserCreate()  # not namespace-aware

    def note(name: str, attributes: dict[str, str]) -> None:
        if not place:
            place.append(parser.CurrentByteIndex + len(f"<{name}".encode()))
        for each in (name, *attributes):
            prefix, colon, rest = each.partition(":")
            if prefix == "xmlns" and colon:
                declared.add(rest)
            elif colon and prefix not in used:
                used.append(prefix)

    parser.StartElementHandler = note
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        wrong = ElementTree.ParseError(str(error))
        wrong.code, wrong.position = error.code, (error.lineno, error.offset)
        raise wrong from error
    missing = [prefix for prefix in used if prefix not in declared and prefix not in _DECLARED]
    declarations = "".join(f' xmlns:{prefix}="{_NAMESPACE}{prefix}"' for prefix in missing).encode()
    return ElementTree.fromstring(content[: place[0]] + declarations + content[place[0] :])
