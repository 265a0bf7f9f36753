"""Expansion of the default classes of an MJCF model: every element gets the attributes of its class.

A class inherits from the class it is nested in, and all actuators of a class share one set of attributes, whatever
their tags. The class of an element is its own, otherwise the nearest ``childclass`` above it, otherwise the main one.
"""

from xml.etree.ElementTree import Element

_MAIN = "main"
# Tags that all set the attributes of the same default actuator.
ACTUATORS = (
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
)
_ACTUATOR = "actuator"
# Elements of a body whose attributes are written out; no others are read here.
_OF_BODIES = ("joint", "geom", "site")

type _Attributes = dict[str, dict[str, str]]


def write_out_defaults(root: Element) -> None:
    """Gives joints, geoms, sites and actuators the attributes of their classes, and removes the classes."""
    classes = _read_classes(root)

    def fill(element: Element, class_name: str, kind: str) -> None:
        given = classes.get(element.get("class", class_name), {}).get(kind, {})
        element.attrib.update({**given, **element.attrib})
        element.attrib.pop("class", None)

    def descend(body: Element, class_name: str) -> None:
        class_name = body.attrib.pop("childclass", class_name)
        for child in body:
            if child.tag == "body":
                descend(child, class_name)
            elif child.tag in _OF_BODIES:
                fill(child, class_name, child.tag)

    for world in root.findall("worldbody"):
        descend(world, _MAIN)
    for element in root.iterfind("actuator/*"):
        fill(element, _MAIN, _ACTUATOR)
    for element in root.findall("default"):
        root.remove(element)


def _read_classes(root: Element) -> dict[str, _Attributes]:
    """Reads attributes by class and kind of element, including those inherited from parent classes."""
    found: dict[str, _Attributes] = {_MAIN: {}}

    def add(element: Element, inherited: _Attributes) -> None:
        own = {kind: dict(attributes) for kind, attributes in inherited.items()}
        for child in element:
            if child.tag != "default":
                kind = _ACTUATOR if child.tag in ACTUATORS else child.tag
                own.setdefault(kind, {}).update(child.attrib)
        found[element.get("class", _MAIN)] = own
        for child in element.findall("default"):
            add(child, own)

    for element in root.findall("default"):
        add(element, found[_MAIN])
    return found
