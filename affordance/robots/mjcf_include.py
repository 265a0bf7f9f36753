"""Expansion of the files that an MJCF model includes, as MuJoCo does before anything else."""

from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.robots.xml_reader import read_xml

# Deepest nesting; models are split by robot, gripper and scene, so deeper nesting is a mistake.
_DEEPEST = 8


def expand_includes(path: Path, root: Element) -> tuple[Path, ...]:
    """Replaces every ``<include>`` by the contents of the named file.

    Args:
        path: File of the model; included files are named relative to its folder, and must be in it or below.
        root: Root element of the model, which is modified.

    Returns: Included files, in the order in which they are named.

    Raises:
        BadValueError: A file is elsewhere, cannot be read, is included twice, or is nested too deeply.
    """
    folder, found = path.parent.resolve(), list[Path]()

    def expand(element: Element, named_in: Path, depth: int) -> None:
        for child in list(element):
            if child.tag != "include":
                expand(child, named_in, depth)
                continue
            name = child.get("file", "")
            file = (folder / name).resolve()
            if not name or not file.is_relative_to(folder):
                problem = f"names {name!r}, must be a file in the model's own folder, {folder}"
                raise BadValueError(named_in, "include", problem)
            if file in found or file == path.resolve():
                raise BadValueError(named_in, "include", f"names {name!r} a second time, must include a file once")
            if depth == _DEEPEST:
                raise BadValueError(named_in, "include", f"nests deeper than {_DEEPEST} files")
            found.append(file)
            content = read_xml(file)
            if content.tag not in ("mujoco", "mujocoinclude"):
                raise BadValueError(file, "", f"is of <{content.tag}>, must be of <mujoco> or <mujocoinclude>")
            expand(content, file, depth + 1)
            place = list(element).index(child)
            element[place : place + 1] = list(content)

    expand(root, path, 0)
    return tuple(found)
