"""Prior of the density of unknown materials."""

from dataclasses import dataclass
from typing import Annotated

from affordance.files.constraints import CheckedFields, Setting, Within
from affordance.objects.inertia import DENSITY_MAX

# Far above any density, so that flat priors are allowed, [kg/m^3].
_SD_MAX = 1e12


@dataclass(frozen=True)
class Prior(CheckedFields):
    """Prior of the density of materials that were never held (docs/decisions/0003-prior.md).

    It is a normal distribution truncated to positive densities.

    Attributes:
        mode: Most probable density, [kg/m^3].
        sd: Standard deviation of the normal distribution before truncation, [kg/m^3].
        deviation: Standard deviation of object densities within a material, as a fraction of the mean density (s_m).

    Example:
        >>> from affordance import Prior, Settings
        >>> Settings(prior=Prior(mode=2700.0, sd=2000.0)).prior.mode
        2700.0
    """

    mode: Annotated[
        float,
        Within(0.0, DENSITY_MAX),
        Setting("kg/m^3", "the density of water is about the average density of objects (Ross & Gregory 1970)"),
    ] = 1000.0
    sd: Annotated[
        float,
        Within(1e-3, _SD_MAX),
        Setting("kg/m^3", "broad: copper, the densest metal in common use, is two standard deviations above"),
    ] = 4000.0
    deviation: Annotated[
        float,
        Within(0.0, 1.0),
        Setting("1", "root mean square of the spreads of materials, 0.01 to 0.1 (docs/decisions/0003-prior.md)"),
    ] = 0.06
