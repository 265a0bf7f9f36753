"""Colours as users write them: by the name of a material, as '#d4a017', or as red, green and blue."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

from affordance.arguments import check_colour
from affordance.exceptions import BadArgumentError, describe_choice
from affordance.objects.colour import Colour
from affordance.objects.load import check_materials, load_materials
from affordance.objects.tool import Material
from affordance.objects.tool_entries import is_colour, parse_colour

# Name of a material, a material, or a colour.
type MaterialLike = str | Material | Sequence[float]

_FORMS = "(a colour is '#d4a017', or red, green and blue from 0 to 1)"


def find_colour(
    material: MaterialLike, materials: Mapping[str, Material] | None = None, argument: str = "material"
) -> Colour:
    """Finds the colour that identifies a material.

    Args:
        material: Name of a material, a material, or a colour.
        materials: Materials by name; those that come with the program if None.
        argument: Name of the argument, for errors.

    Raises:
        BadArgumentError: The name is neither a known material nor a colour.
    """
    if isinstance(material, Material):
        return material.colour
    if not isinstance(material, str):
        return check_colour(argument, material)
    if is_colour(material):
        return parse_colour(material)
    known = _load_own() if materials is None else check_materials(materials)
    if material not in known:
        raise BadArgumentError(argument, "", f"{describe_choice(material, known)} {_FORMS}")
    return known[material].colour


@lru_cache(maxsize=1)
def _load_own() -> dict[str, Material]:
    return load_materials()
