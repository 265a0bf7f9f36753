"""Files that an MJCF model includes, put where they are named, as MuJoCo does before anything else."""

from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.robots.xml_reader import read_xml

# Models are split by robot, gripper and scene; who nests deeper than this made a mistake.
_DEEPEST = 8


def expand_includes(path: Path, root: Element) -> tuple[Path, ...]:
    """Replaces every ``<include>`` by what the file that it names holds.

    Args:
        path: The model's file; included files are named relative to its folder, and lie in it or below.
        root: Root element of the model, which is changed.

    Returns: Files that were included, in the order in which they are named.

    Raises:
        BadValueError: A file lies elsewhere, cannot be read, is included twice, or nests too deep.
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
