"""Summarises the posterior of a payload, including the quantities that the run did not determine."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.belief.object_belief import ObjectBelief
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.posterior.body_posterior import WeightedBodies
from affordance.extensions.payload.posterior.payload_fit import PayloadFit
from affordance.files.html_table import build_table
from affordance.objects.inertia import compute_point_parameters

QUANTITIES = ("mass", "c_x", "c_y", "c_z", "I_xx", "I_yy", "I_zz", "I_xy", "I_xz", "I_yz")
UNITS = ("kg", *["m"] * 3, *["kg m^2"] * 6)
MASS, COM, MOMENTS = slice(0, 1), slice(1, 4), slice(4, 7)


class Marginals(NamedTuple):
    """Marginals of mass, centre of mass and moments about the centre of mass, (10,) each.

    Entries have the order of QUANTITIES, [kg, m, kg m^2]. Products of inertia are -integral(x y dm).
    """

    mean: Array
    sd: Array
    low50: Array
    high50: Array
    low90: Array
    high90: Array


def describe_bodies(pi: Array) -> Array:
    """Computes mass, centre of mass and moments about it from pi, (N, 10), in the order of QUANTITIES."""
    m, c = pi[:, 0], pi[:, 1:4] / pi[:, :1]
    return np.column_stack([m, c, pi[:, 4:] - m[:, None] * compute_point_parameters(c)[:, 4:]])


def summarise(values: Array, weights: Array) -> Marginals:
    """Computes the marginals of weighted samples, (N, 10), with weights, (N,)."""
    mean = weights @ values
    sd = np.sqrt(weights @ (values - mean) ** 2)
    order = np.argsort(values, axis=0)
    quantiles = np.empty((4, values.shape[1]))
    for i in range(values.shape[1]):
        share = weights[order[:, i]]
        # The quantile of a sample is the middle of its share of the cumulative distribution.
        quantiles[:, i] = np.interp([0.05, 0.25, 0.75, 0.95], np.cumsum(share) - 0.5 * share, values[order[:, i], i])
    return Marginals(mean, sd, quantiles[1], quantiles[2], quantiles[0], quantiles[3])


# A quantity is undetermined if its posterior SD exceeds this share of its prior SD.
UNSEEN = 0.8


def find_hidden_direction(bodies: Array, weights: Array, prior_bodies: Array) -> Array | None:
    """Finds a direction along which a run hardly determines the centre of mass, (3,).

    Args:
        bodies: Samples of the ten parameters, shape (N, 10).
        weights: Weights of the samples, shape (N,).
        prior_bodies: Samples of the prior, shape (M, 10).

    Returns: A unit vector; None if there is no such direction.
    """
    centres, before = describe_bodies(bodies)[:, COM], describe_bodies(prior_bodies)[:, COM]
    away = centres - weights @ centres
    values, vectors = np.linalg.eigh((away * weights[:, None]).T @ away)
    along: Array = vectors[:, -1]
    if values[-1] <= UNSEEN**2 * along @ np.cov(before.T) @ along:
        return None
    upwards: Array = along * np.sign(along[np.argmax(np.abs(along))])
    return upwards


def describe_unseen(
    m: Marginals,
    share: Array,
    hidden: frozenset[str],
    prior_bodies: Array,
    *,
    is_light: bool,
    is_at_rest: bool,
    direction: Array | None,
) -> Iterator[str]:
    """Describes the quantities that the run did not determine, one sentence each.

    Args:
        m: Marginals after the run.
        share: Posterior SDs divided by prior SDs, shape (10,).
        hidden: Names, as in QUANTITIES, of the undetermined quantities.
        prior_bodies: Samples of the prior, shape (M, 10).
        is_light: True if little or nothing is held.
        is_at_rest: True if the arm was held in postures.
        direction: Direction along which the centre of mass is undetermined; None if there is none.
    """
    for name, part in (("mass", MASS), ("centre of mass", COM), ("moments of inertia", MOMENTS)):
        of_part = [i for i in range(part.start, part.stop) if QUANTITIES[i] in hidden]
        if part is COM and direction is not None and len(of_part) < 3:
            x, y, z = direction
            yield f"centre of mass along ({x:.2f}, {y:.2f}, {z:.2f}): not determined by the run"
        if not of_part:
            continue
        worst = max(of_part, key=lambda i: share[i])
        ranges = f"90 % from {m.low90[worst]:.2g} to {m.high90[worst]:.2g}"
        if part is MASS:
            low, high = np.quantile(prior_bodies[:, 0], [0.05, 0.95])
            ranges = f"{ranges} kg, before the run from {low:.2g} to {high:.2g}"
        else:
            ranges = f"{QUANTITIES[worst]}: {ranges}"
        if part is MOMENTS and is_at_rest:
            reason = "an arm at rest cannot show them, so they follow from the prior"
        elif share[worst] > UNSEEN:
            moves = "too few or too similar postures" if is_at_rest else "motion too slow or too short"
            reason = f"{moves} to show it, so the prior dominates"
            ranges = f"{ranges}, SD {100 * share[worst]:.0f} % of the prior's"
        elif part is MASS:
            reason = "little or nothing is held" if is_light else "no larger than the runs' errors"
        else:
            reason = "known only to a factor"
        yield f"{name} ({', '.join(QUANTITIES[i] for i in of_part)}): {reason} ({ranges})"


# A positive quantity is also undetermined if its SD exceeds this share of its posterior mean.
_VAGUE = 0.4
# The load is light if the 90 % interval of the mass ends below this quantile of the prior.
_LIGHT = 0.25
# SD of a seen object's centre of mass, [m], and SDs of mass and moments relative to their means, below which they
# count as determined in any case.
_SHARP, _SHARP_SHARE = 0.005, 0.1
_OF_COM = np.isin(np.arange(len(QUANTITIES)), np.r_[COM])
_FEW_SAMPLES = 100.0  # effective sample size below which the tails of an interval are unreliable
# p-value below which an object is not what it looks like.
SURPRISE = 0.001


class LearnedDensity(NamedTuple):
    """Density of a material after a run, according to the updated memory."""

    colour: tuple[float, float, float]  # colour of the material, red, green and blue in [0, 1]
    median: float  # median, [kg/m^3]
    interval90: tuple[float, float]  # 90 % credible interval, [kg/m^3]


class HalfCheck(NamedTuple):
    """Masses identified in both halves of a run, each with the gains from the other half.

    Arrays have shape (2,), in order of time.
    """

    mass: Array  # means of the mass, [kg]
    sd: Array  # standard deviations of the mass, [kg]
    error: Array  # relative errors of the mass
    inside: Array  # 1 if the 90 % interval contains the reference mass, else 0
    centre_of_mass: Array  # means of the centre of mass, shape (2, 3), [m]


@dataclass(frozen=True)
class PayloadBelief:
    """Posterior of a payload at the tip T.

    Attributes:
        source: File of the run.
        analysis: Treatment of the empty arm, in words.
        bodies: Weighted, physically consistent samples of the ten parameters: mass, first moment, and moments and
            products of inertia about To, expressed in T.
        prior_bodies: Samples of the prior, shape (N, 10).
        channel_names: Names of the joints, or of the components of the wrench.
        unit: Unit of the signal.
        gains: Posterior means of g and h = mu g of each channel, shape (C, 2).
        load_friction: Load friction mu of each channel, shape (C,).
        noise_sd: Standard deviation of the residual per sample, shape (C,), in the signal's unit.
        agreement: Correlation time of the errors, shape (C,), [s].
        assumptions: Assumptions, one sentence each.
        notes: Findings of the analysis, one sentence each.
        fit: Fit of the run, for figures and checks.
        calibration: Gains calibrated in this run with a weighed load; None if they were given or estimated.
        reference_mass: Weighed mass of the load, [kg]; None if unknown.
        halves: Check of the calibration with both halves of the run; None without a calibration.
        seen: Posterior of the parts that a camera saw, with an updated memory; None without a camera.
        likelihood: Likelihood of the densities of these parts; None without a camera.
        felt: Quadratic log likelihood of the ten parameters, without mass that the camera does not see; None without
            a camera.
        p_value: Probability of a run at least as improbable if the object is what it looks like; None without a
            camera.
        doubts: Reasons not to trust the result, one sentence each; empty without any.
        advice: Recording that would identify the mass, in words; empty if this run identified it.
        tip: Name of the frame T.

    Example:
        >>> from affordance import MODELS, Runs, identify, load_robot, read_run
        >>> loaded, empty = (read_run(MODELS / "demo" / f"{name}.csv") for name in ("bar_of_oak", "empty"))
        >>> identify(load_robot(MODELS / "arm.dmd.yaml"), Runs(loaded, (empty,))).is_trusted
        True
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
    fit: PayloadFit
    calibration: Gains | None = None
    reference_mass: float | None = None
    halves: HalfCheck | None = None
    seen: ObjectBelief | None = None
    likelihood: Likelihood | None = None
    felt: Quadratic | None = None
    p_value: float | None = None
    doubts: tuple[str, ...] = ()
    advice: str = ""
    tip: str = ""

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
        """Posterior mean of the ten parameters, shape (10,), which is physically consistent."""
        mean: Array = self.bodies.weights @ self.bodies.pi
        return mean

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance of the ten parameters, shape (10, 10)."""
        away = self.bodies.pi - self.parameters
        covariance: Array = (away * self.bodies.weights[:, None]).T @ away
        return covariance

    @cached_property
    def marginals(self) -> Marginals:
        """Marginals of mass, centre of mass and moments about the centre of mass."""
        return summarise(describe_bodies(self.bodies.pi), self.bodies.weights)

    @property
    def mass(self) -> float:
        """Mean mass, [kg]."""
        return float(self.marginals.mean[0])

    @property
    def mass_sd(self) -> float:
        """Standard deviation of the mass, [kg]."""
        return float(self.marginals.sd[0])

    @property
    def mass_interval90(self) -> tuple[float, float]:
        """90 % credible interval of the mass, [kg]."""
        return float(self.marginals.low90[0]), float(self.marginals.high90[0])

    @property
    def centre_of_mass(self) -> Array:
        """Mean centre of mass p_TTcm, shape (3,), [m]."""
        return self.marginals.mean[COM]

    @property
    def setting(self) -> PayloadSetting | None:
        """Payload setting for a controller; None if the run does not identify the mass.

        Moments that the run does not determine are left out.
        """
        if self.hidden & set(QUANTITIES[MASS]):
            return None
        mean = self.marginals.mean
        is_guessed = bool(self.hidden & set(QUANTITIES[COM])) or self.hidden_direction is not None
        inertia = None if self.hidden & set(QUANTITIES[MOMENTS]) else mean[MOMENTS.start :]
        return PayloadSetting(float(mean[0]), mean[COM], inertia, is_guessed)

    @property
    def learned(self) -> tuple[LearnedDensity, ...]:
        """Densities of the seen object's materials after the run; empty without a camera."""
        if self.seen is None:
            return ()
        low, median, high = self.seen.memory.belief.compute_percentiles([0.05, 0.5, 0.95])
        colours = self.seen.memory.colours
        return tuple(
            LearnedDensity(colours[i], float(median[i]), (float(low[i]), float(high[i])))
            for i in sorted(self.seen.colours)
        )

    @property
    def is_trusted(self) -> bool:
        """True if there is no reason to doubt the result."""
        return not self.doubts

    @property
    def teaches(self) -> bool:
        """True if a memory should learn from the run: it is trusted, and the object is what it looks like."""
        return self.is_trusted and self.seen is not None and (self.p_value is None or self.p_value >= SURPRISE)

    @cached_property
    def hidden(self) -> frozenset[str]:
        """Names of the undetermined quantities, as in QUANTITIES."""
        m = self.marginals
        is_vague = (m.sd > _VAGUE * m.mean) & ~_OF_COM  # products of inertia may be zero
        is_hidden = (self._share_of_prior > UNSEEN) | is_vague
        if self.seen is not None:  # the prior of a seen object is narrow
            is_hidden &= m.sd > np.where(_OF_COM, _SHARP, _SHARP_SHARE * np.abs(m.mean))
        if self.calibration is not None:
            is_hidden[MASS] = False  # a scale determined the mass
        return frozenset(name for name, hidden in zip(QUANTITIES[: MOMENTS.stop], is_hidden, strict=False) if hidden)

    @property
    def is_light(self) -> bool:
        """True if the mass is small compared with its prior, with a large relative uncertainty."""
        is_small = self.marginals.high90[0] < np.quantile(self.prior_bodies[:, 0], _LIGHT)
        return bool(is_small) and not self.hidden.isdisjoint(QUANTITIES[MASS])

    @property
    def shows_mass(self) -> bool:
        """True if the run determines the mass, or shows that little or nothing is held."""
        return self.is_light or self.hidden.isdisjoint(QUANTITIES[MASS])

    @cached_property
    def _share_of_prior(self) -> Array:
        """Posterior SDs divided by prior SDs, shape (10,)."""
        prior_sd = describe_bodies(self.prior_bodies).std(axis=0)
        share: Array = self.marginals.sd / np.maximum(prior_sd, np.finfo(float).tiny)
        return share

    @cached_property
    def hidden_direction(self) -> Array | None:
        """Direction in T along which postures leave the centre of mass undetermined, (3,); None without one."""
        if not self.fit.evidence.is_at_rest or self.seen is not None:
            return None
        return find_hidden_direction(self.bodies.pi, self.bodies.weights, self.prior_bodies)

    @cached_property
    def unseen(self) -> tuple[str, ...]:
        """Quantities that this run leaves undetermined, one sentence each."""
        return tuple(
            describe_unseen(
                self.marginals,
                self._share_of_prior,
                self.hidden,
                self.prior_bodies,
                is_light=self.is_light,
                is_at_rest=self.fit.evidence.is_at_rest,
                direction=self.hidden_direction,
            )
        )

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the numbers, one sentence each."""
        sentences = []
        if self.bodies.effective_size < _FEW_SAMPLES:
            sentences.append(f"only {self.bodies.effective_size:.0f} samples are effective: intervals are inaccurate")
        if self.p_value is not None and self.p_value < SURPRISE:
            sentences.append(
                f"the object is not what it looks like (p = {self.p_value:.1g}), or more of it is hidden than assumed"
            )
        if self.reference_mass is not None and self.calibration is None:
            low, high = self.mass_interval90
            if not low <= self.reference_mass <= high:
                sentences.append(f"the reference mass of {self.reference_mass:g} kg is outside the 90 % interval")
        return tuple(sentences)

    def to_dict(self) -> dict[str, Any]:
        """Converts all results to plain numbers and texts for JSON, in SI units at the tip."""
        m, moments = self.marginals, slice(4, 10)
        pairs50, pairs90 = np.column_stack([m.low50, m.high50]), np.column_stack([m.low90, m.high90])
        content: dict[str, Any] = {
            "trusted": self.is_trusted,
            "doubts": list(self.doubts),
            "source": self.source,
            "analysis": self.analysis,
            "frame": self.tip,
            "mass_kg": self.mass,
            "mass_sd_kg": self.mass_sd,
            "mass_interval50": list(pairs50[0]),
            "mass_interval90": list(pairs90[0]),
            "com_m": list(m.mean[COM]),
            "com_sd_m": list(m.sd[COM]),
            "com_interval50": pairs50[COM].tolist(),
            "com_interval90": pairs90[COM].tolist(),
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
            "mass_seen": self.shows_mass,
            "not_seen": list(self.unseen),
            "would_show_mass": self.advice,
            "warnings": list(self.warnings),
            "reference_mass_kg": self.reference_mass,
            "surprise_p": self.p_value,
        }
        if self.halves is not None:
            content["halves"] = self.halves._asdict()
        if self.seen is not None:
            content["densities_kg_m3"] = [each._asdict() for each in self.learned]
        return content
