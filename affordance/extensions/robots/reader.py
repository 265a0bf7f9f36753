"""Reads robot files in any of the three formats."""

from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import Description
from affordance.extensions.robots.mjcf import read_mjcf
from affordance.extensions.robots.sdf import read_sdf
from affordance.extensions.robots.urdf import read_urdf
from affordance.extensions.robots.xacro_file import AS_IT_IS, XacroOptions, expand, is_template
from affordance.extensions.robots.xml_reader import parse_xml, read_xml

_READERS = {"robot": read_urdf, "sdf": read_sdf, "mujoco": read_mjcf}
# Largest number of links and joints: a humanoid with hands has 150; Drake needs a minute for thousands in series.
_BODIES, _MOST_BODIES = ("link", "body", "joint"), 1000


def read_robot(path: Path, xacro: XacroOptions = AS_IT_IS) -> Description:
    """Reads a URDF, SDF or MJCF file, or a xacro template; another root element raises a BadValueError."""
    expanded = expand(path, xacro) if is_template(path) else None
    if expanded is None and (xacro.values or xacro.packages):
        raise BadValueError(path, "", "is no xacro template, must be one if NAME:=VALUE or --package is given")
    root = read_xml(path) if expanded is None else parse_xml(path, expanded.content)
    if root.tag not in _READERS:
        raise BadValueError(path, "", f"begins with <{root.tag}>, must with <robot> (URDF), <sdf> or <mujoco> (MJCF)")
    _check_number(path, root)
    try:
        description = _READERS[root.tag](path, root)
    except RecursionError as error:
        raise BadValueError(path, "", "nests too deeply, with the files that it includes") from error
    _check_number(path, root)  # includes the included files
    if expanded is not None:
        description.sources += expanded.sources
    return description


def _check_number(path: Path, root: Element) -> None:
    """Raises a BadValueError for more links and joints than Drake can process quickly."""
    if (num_bodies := sum(1 for element in root.iter() if element.tag in _BODIES)) > _MOST_BODIES:
        raise BadValueError(path, "", f"has {num_bodies} links and joints, must have at most {_MOST_BODIES}")
