"""What is believed of a held body after a run, and what of it the run could not see."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.identification.body_posterior import WeightedBodies
from affordance.identification.gains import Gains
from affordance.notebook import build_table

# Standard deviations above this share of the prior's: the run said next to nothing.
_UNSEEN = 0.8
# So are those of positive quantities above this share of their mean.
_VAGUE = 0.4
# Samples that count for less than this are too few for the tails of an interval.
_FEW_SAMPLES = 100.0
QUANTITIES = ("mass", "c_x", "c_y", "c_z", "I_xx", "I_yy", "I_zz", "I_xy", "I_xz", "I_yz")
UNITS = ("kg", *["m"] * 3, *["kg m^2"] * 6)
_MASS, _COM, _MOMENTS, _PRODUCTS = slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10)


class Marginals(NamedTuple):
    """Mass, centre of mass and moments of inertia about it, one by one, shape (10,) each.

    In the order of QUANTITIES, [kg, m, kg m^2]; products of inertia are -integral(x y dm).
    """

    mean: Array
    sd: Array
    low50: Array
    high50: Array
    low90: Array
    high90: Array


@dataclass(frozen=True)
class PayloadBelief:
    """The posterior of a payload at the tip T.

    Attributes:
        source: File of the run.
        analysis: How the empty arm was taken off.
        bodies: Weighted samples of the ten parameters about To, expressed in T; every one a possible body.
        prior_bodies: Bodies believed in before the run, shape (N, 10).
        channel_names: Joints, or components of the wrench.
        unit: Of the signal.
        gains: Gains and load friction as this run left them, shape (C, 2).
        load_friction: mu of each channel, shape (C,).
        noise_sd: Standard deviation of a residual, shape (C,), in the signal's unit.
        agreement: Time over which errors agree, shape (C,), [s].
        assumptions: What was assumed, a sentence each.
        notes: What was found on the way, a sentence each.
        calibration: Gains found with a load that was weighed; None if they were given.
        reference_mass: What the load weighs on a scale, if that is known, [kg].
        seen: Posterior of the parts a camera saw, its memory having learned; None without one.
        likelihood: Of the densities of those parts.
        p_value: Probability of a run as surprising as this, had the object been what it looks like; None without.
    """

    source: str
    analysis: str
    bodies: WeightedBodies
    prior_bodies: Array
    channel_names: tuple[str, ...]
    unit: str
    gains: Array
    load_friction: Array
    noise_sd: Array
    agreement: Array
    assumptions: tuple[str, ...]
    notes: tuple[str, ...]
    calibration: Gains | None = None
    reference_mass: float | None = None
    seen: ObjectBelief | None = None
    likelihood: Likelihood | None = None
    p_value: float | None = None

    def __repr__(self) -> str:
        x, y, z = self.centre_of_mass
        return (
            f"PayloadBelief({self.mass:.4g} ± {self.mass_sd:.2g} kg, centre of mass ({x:.3g}, {y:.3g}, {z:.3g}) m, "
            f"{len(self.bodies.pi)} samples, {len(self.warnings)} warnings; {self.source})"
        )

    def _repr_html_(self) -> str:
        m = self.marginals
        rows = [
            [name, f"{m.mean[i]:.4g}", f"{m.sd[i]:.2g}", f"{m.low90[i]:.4g} to {m.high90[i]:.4g}", unit]
            for i, (name, unit) in enumerate(zip(QUANTITIES, UNITS, strict=True))
        ]
        header = ["quantity", "mean", "SD", "90 % interval", "unit"]
        return build_table(f"{self.source}: {self.analysis}", header, rows)

    @cached_property
    def parameters(self) -> Array:
        """Mean of the ten parameters, shape (10,); itself a possible body."""
        mean: Array = self.bodies.weights @ self.bodies.pi
        return mean

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the ten parameters, shape (10, 10)."""
        away = self.bodies.pi - self.parameters
        covariance: Array = (away * self.bodies.weights[:, None]).T @ away
        return covariance

    @cached_property
    def marginals(self) -> Marginals:
        """Mass, centre of mass and moments about it, one by one."""
        return summarise(describe_bodies(self.bodies.pi), self.bodies.weights)

    @property
    def mass(self) -> float:
        """Mean mass, [kg]."""
        return float(self.marginals.mean[0])

    @property
    def mass_sd(self) -> float:
        """Its standard deviation, [kg]."""
        return float(self.marginals.sd[0])

    @property
    def mass_interval90(self) -> tuple[float, float]:
        """The 90 % interval of the mass, [kg]."""
        return float(self.marginals.low90[0]), float(self.marginals.high90[0])

    @property
    def centre_of_mass(self) -> Array:
        """Mean centre of mass p_TTcm, shape (3,), [m]."""
        return self.marginals.mean[_COM]

    @cached_property
    def unseen(self) -> tuple[str, ...]:
        """What could not be seen from this motion, a sentence each."""
        prior_sd = describe_bodies(self.prior_bodies).std(axis=0)
        m = self.marginals
        share = m.sd / np.maximum(prior_sd, np.finfo(float).tiny)
        # What is positive is also unseen if it is known to a factor only.
        vague = np.zeros(len(share), dtype=bool)
        vague[_MASS], vague[_MOMENTS] = (
            m.sd[_MASS] > _VAGUE * m.mean[_MASS],
            m.sd[_MOMENTS] > _VAGUE * m.mean[_MOMENTS],
        )
        parts = [("mass", _MASS), ("centre of mass", _COM), ("moments of inertia", _MOMENTS)]
        if self.calibration is not None:
            parts = parts[1:]  # the scale saw the mass
        sentences = []
        for name, part in parts:
            hidden = [i for i in range(part.start, part.stop) if share[i] > _UNSEEN or vague[i]]
            if hidden:
                worst = max(hidden, key=lambda i: share[i])
                ranges = f"90 % from {m.low90[worst]:.2g} to {m.high90[worst]:.2g}"
                sentences.append(
                    f"{name} ({', '.join(QUANTITIES[i] for i in hidden)}): moves too slowly or too briefly to see, "
                    f"the prior decides ({QUANTITIES[worst]}: {ranges}, SD {100 * share[worst]:.0f} % of the prior's)"
                )
        return tuple(sentences)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What the reader should know before using the numbers, a sentence each."""
        sentences = []
        if self.bodies.effective_size < _FEW_SAMPLES:
            sentences.append(f"only {self.bodies.effective_size:.0f} samples count: take intervals with caution")
        if self.p_value is not None and self.p_value < 0.001:
            sentences.append(
                f"the object is not what it looks like (p = {self.p_value:.1g}), or more of it is unseen than assumed"
            )
        if self.reference_mass is not None and self.calibration is None:
            low, high = self.mass_interval90
            if not low <= self.reference_mass <= high:
                sentences.append(f"the reference mass of {self.reference_mass:g} kg lies outside the 90 % interval")
        return tuple(sentences)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and texts, for JSON; SI units, at the tip."""
        m = self.marginals
        pairs50, pairs90 = np.column_stack([m.low50, m.high50]), np.column_stack([m.low90, m.high90])
        moments = slice(4, 10)
        content: dict[str, Any] = {
            "source": self.source,
            "analysis": self.analysis,
            "mass_kg": self.mass,
            "mass_sd_kg": self.mass_sd,
            "mass_interval50": list(pairs50[0]),
            "mass_interval90": list(pairs90[0]),
            "com_m": list(m.mean[_COM]),
            "com_sd_m": list(m.sd[_COM]),
            "com_interval50": pairs50[_COM].tolist(),
            "com_interval90": pairs90[_COM].tolist(),
            "inertia_order": ["Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"],
            "inertia_kg_m2": list(m.mean[moments]),
            "inertia_sd_kg_m2": list(m.sd[moments]),
            "inertia_interval50": pairs50[moments].tolist(),
            "inertia_interval90": pairs90[moments].tolist(),
            "parameters": list(self.parameters),
            "parameters_covariance": self.covariance.tolist(),
            "effective_samples": self.bodies.effective_size,
            "joints": list(self.channel_names),
            "gain": list(self.gains[:, 0]),
            "load_friction": list(self.load_friction),
            "residual_sd": list(self.noise_sd),
            "error_correlation_s": list(self.agreement),
            "unit": self.unit,
            "assumed": list(self.assumptions),
            "found": list(self.notes),
            "not_seen": list(self.unseen),
            "warnings": list(self.warnings),
            "reference_mass_kg": self.reference_mass,
            "surprise_p": self.p_value,
        }
        if self.seen is not None:
            low, median, high = self.seen.memory.belief.compute_percentiles([0.05, 0.5, 0.95])
            content["densities_kg_m3"] = [
                {"colour": list(colour), "median": float(median[i]), "interval90": [float(low[i]), float(high[i])]}
                for i, colour in enumerate(self.seen.memory.colours)
            ]
        return content


def describe_bodies(pi: Array) -> Array:
    """Mass, centre of mass and moments about it of bodies, pi of shape (N, 10), in the order of QUANTITIES."""
    m, c = pi[:, 0], pi[:, 1:4] / pi[:, :1]
    x, y, z = c.T
    shift = np.stack([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z], axis=1)
    return np.column_stack([m, c, pi[:, 4:] - m[:, None] * shift])


def summarise(values: Array, weights: Array) -> Marginals:
    """Summarises weighted samples, (N, 10) and (N,)."""
    mean = weights @ values
    sd = np.sqrt(weights @ (values - mean) ** 2)
    order = np.argsort(values, axis=0)
    quantiles = np.empty((4, values.shape[1]))
    for i in range(values.shape[1]):
        share = weights[order[:, i]]
        # Each sample stands for the middle of its share.
        quantiles[:, i] = np.interp([0.05, 0.25, 0.75, 0.95], np.cumsum(share) - 0.5 * share, values[order[:, i], i])
    return Marginals(mean, sd, quantiles[1], quantiles[2], quantiles[0], quantiles[3])
