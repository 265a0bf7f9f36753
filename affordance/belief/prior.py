"""Prior of the density of materials that were never held."""

from dataclasses import dataclass
from typing import Annotated

from affordance.files.constraints import CheckedFields, Setting, Within
from affordance.objects.inertia import DENSITY_MAX

# Far above any density, to permit flat priors, [kg/m^3].
_SD_MAX = 1e12


@dataclass(frozen=True)
class Prior(CheckedFields):
    """Prior of the density of any material that was never held (docs/decisions/0003-prior.md).

    Attributes:
        mode: Most probable density, [kg/m^3].
        sd: Standard deviation of the unrestricted normal distribution, [kg/m^3].
        deviation_sd: Standard deviation of one object's density about its material's mean (s_m), [kg/m^3].

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
        Setting("kg/m^3", "broad: copper, the densest metal in common use, lies two standard deviations above"),
    ] = 4000.0
    deviation_sd: Annotated[
        float,
        Within(0.0, _SD_MAX),
        Setting("kg/m^3", "spread within woods, brasses and steels, 60 to 90 kg/m^3 (docs/decisions/0003-prior.md)"),
    ] = 100.0
