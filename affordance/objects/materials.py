"""Materials with colour, density and density spread, and their file format.

Users can write a colour as the name of a material, in hexadecimal such as '#d4a017', or as three numbers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, override

from pydantic import AfterValidator, Field, RootModel
from pydantic_core import PydanticCustomError

from affordance.arguments import check_colour, check_kind
from affordance.exceptions import BadArgumentError, describe_choice, show_value
from affordance.files.constraints import Checked, CheckedFields, Name, StrPath, Text, Within, check_path, complain
from affordance.files.data_model import DataModel, load_model
from affordance.files.model_folder import MODELS
from affordance.objects.colour import COLOUR_FORM, Colour, is_colour, parse_colour
from affordance.objects.inertia import DENSITY_MAX

# Bounds of densities in simulations and beliefs, [kg/m^3]. They are wider than the bounds of real materials.
DENSITIES = Within(1e-3, 1e6)
# Least density in a materials file, [kg/m^3]: the lightest packing foam (ASTM C578, type XI). Densities that are
# given in g/cm^3 by mistake are smaller, except for metals such as tungsten and gold.
_LIGHTEST = 12.0
# The program's own materials file.
MATERIALS = MODELS / "materials.yaml"
_FORMS = "(a colour is written as '#d4a017', or as red, green and blue from 0 to 1)"


@dataclass(frozen=True)
class Material(CheckedFields):
    """Material of a component.

    Attributes:
        name: Key in the materials file.
        colour: Red, green and blue in [0, 1].
        density: Mean density of objects made of this material, [kg/m^3].
        density_sd: Standard deviation between such objects, [kg/m^3]. Simulations I to IV do not draw from it: their
            objects have the mean, and learners assume ``Prior.deviation``.
        source: Source of the density.

    Example:
        >>> from affordance import Material
        >>> cork = Material("cork", (0.78, 0.66, 0.47), density=240.0, density_sd=30.0)
        >>> cork.density
        240.0
    """

    name: str
    colour: Annotated[Colour, Checked(check_colour)]
    density: Annotated[float, DENSITIES]
    density_sd: Annotated[float, Within(0.0, DENSITY_MAX)] = 0.0
    source: str = ""


# Anything that identifies a material: its name, a material, or a colour.
type MaterialLike = str | Material | Sequence[float]


def _check_colour(text: str) -> str:
    if not is_colour(text):
        raise complain(f"is {text!r}, {COLOUR_FORM}")
    return text


type ColourText = Annotated[str, Text(), AfterValidator(_check_colour)]


@dataclass(frozen=True)
class _FileDensity(Within):
    """Constraint on a density in a file, [kg/m^3]. Error messages name the unit and convert values in g/cm^3."""

    @override
    def check(self, value: Any, at: str = "") -> float:
        try:
            return super().check(value, at)
        except PydanticCustomError as error:
            problem = (error.context or {})["problem"]
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise complain(f"{problem} of kg/m^3, the unit of density_sd too", at) from None
            problem += " kg/m^3"
            if self.low <= 1000.0 * value <= self.high:
                problem += f"; {show_value(value)} g/cm^3 is {1000.0 * value:.12g} kg/m^3, the unit of density_sd too"
            raise complain(problem, at) from None


class MaterialEntry(DataModel):
    """Material in a file."""

    colour: Annotated[ColourText, Field(description="Red, green and blue in hexadecimal, as '#b5a642'.")]
    density: Annotated[
        float, _FileDensity(_LIGHTEST, DENSITY_MAX), Field(description="Density of the material, [kg/m^3].")
    ]
    density_sd: Annotated[
        float,
        Within(0.0, DENSITY_MAX),
        Field(description="Standard deviation of density between objects made of the material, [kg/m^3]."),
    ]
    source: Annotated[str, Text(), Field(description="Source of the density.")] = "no source is given"

    def build(self, name: str) -> Material:
        """Builds the material."""
        return Material(name, parse_colour(self.colour), self.density, self.density_sd, self.source)


class _MaterialsFile(RootModel[Annotated[dict[Name, MaterialEntry], Field(min_length=1)]]):
    """Contents of a materials file."""


def load_materials(path: StrPath = MATERIALS) -> dict[str, Material]:
    """Loads a materials file.

    Each material has a name, colour, density, density_sd and optionally a source.

    Raises:
        BadValueError: The file or one of its values is invalid; the message names file, key and value.
    """
    return {
        name: entry.build(name) for name, entry in load_model(check_path("path", path), _MaterialsFile).root.items()
    }


_load_own = lru_cache(maxsize=1)(load_materials)


def check_materials(materials: object) -> Mapping[str, Material]:
    """Returns a mapping of names to materials, as from ``load_materials``, after checking it.

    Raises:
        BadArgumentError: The argument is not such a mapping.
    """
    if not isinstance(materials, Mapping):
        problem = (
            f"is of type {type(materials).__name__}, must be a mapping of names to materials, see load_materials"
        )
        raise BadArgumentError("materials", "", problem)
    return {name: check_kind(f"materials[{name!r}]", each, Material) for name, each in materials.items()}


def find_colour(
    material: MaterialLike, materials: Mapping[str, Material] | None = None, argument: str = "material"
) -> Colour:
    """Returns the colour of a material, which may be given in any notation.

    Args:
        material: Name, material or colour.
        materials: Materials to search for a name; None for the program's own.
        argument: Name of the argument in error messages.

    Raises:
        BadArgumentError: The name is unknown, or the colour is invalid.
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
