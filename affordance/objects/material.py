"""Materials: colour, and density with its spread between objects."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from affordance.arguments import check_colour
from affordance.checked_fields import Checked, CheckedFields
from affordance.files.constraints import Within
from affordance.objects.colour import Colour
from affordance.objects.inertia import DENSITIES, DENSITY_MAX


@dataclass(frozen=True)
class Material(CheckedFields):
    """Material of a component.

    Attributes:
        name: Key in the materials file.
        colour: Red, green and blue in [0, 1].
        density: Mean density of objects made of it, [kg/m^3].
        density_sd: Standard deviation between such objects, [kg/m^3].
        source: Source of the density.
    """

    name: str
    colour: Annotated[Colour, Checked(check_colour)]
    density: Annotated[float, DENSITIES]
    density_sd: Annotated[float, Within(0.0, DENSITY_MAX)] = 0.0
    source: str = ""


# Name of a material, a material, or a colour.
type MaterialLike = str | Material | Sequence[float]
