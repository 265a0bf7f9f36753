"""Inference of a payload from evidence, whatever the runs and the analysis that it comes from."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.assumptions import list_assumptions
from affordance.identification.body_posterior import draw_bodies
from affordance.identification.evidence import Evidence
from affordance.identification.gains import Gains
from affordance.identification.part_posterior import NotTheSeenObjectError, PlacedObject, SeenObject, infer_parts
from affordance.identification.payload_belief import PayloadBelief
from affordance.identification.payload_fit import PayloadFit, build_channel_prior, fit_payload
from affordance.identification.settings import DEFAULT_SETTINGS, IdentificationSettings
from affordance.identification.solid_prior import SolidPrior

_NUM_PRIOR_BODIES = 1000


class Identification(NamedTuple):
    """Belief about a payload with the fit behind it, for plots and for storing gains.

    Attributes:
        belief: Posterior of the payload.
        fit: Fit of the run.
        gains: Gains before the run.
    """

    belief: PayloadBelief
    fit: PayloadFit
    gains: Gains

    def __repr__(self) -> str:
        return f"Identification({self.belief!r})"

    def _repr_html_(self) -> str:
        return self.belief._repr_html_()


def infer(
    evidence: Evidence,
    gains: Gains,
    *,
    calibration: Gains | None = None,
    reference_mass: float | None = None,
    seen: SeenObject | None = None,
    X_GT: Array | None = None,
    solid_prior: SolidPrior | None = None,
    deviation_sd: float = 100.0,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> Identification:
    """Infers the belief about a payload from evidence.

    Args:
        evidence: Evidence of a loaded run.
        gains: Gains for this run, drift included.
        calibration: Gains found in this very run with its reference mass; None if they come from elsewhere.
        reference_mass: Mass of the load by a scale, [kg]; None if unknown.
        seen: Object that a camera saw; None without a camera.
        X_GT: Pose of the seen object in the tip, shape (4, 4); None for the identity.
        solid_prior: Prior of a body that no camera has seen; None for any solid that a hand could hold.
        deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].
        settings: Settings of nuisances and samples.
    """
    evidence = replace(evidence, least_variance=np.maximum(evidence.least_variance, gains.least_variance))
    solid = SolidPrior.for_hand() if solid_prior is None else solid_prior
    if calibration is not None and reference_mass is not None:
        solid = solid.with_mass(reference_mass, 1e-3 * reference_mass)
    # Torques determine the body up to a factor common to all gains.
    felt = solid.with_common_factor(gains.common_sd)
    fit = fit_payload(evidence, build_channel_prior(evidence, gains, settings), felt, settings)
    rng = np.random.default_rng(settings.seed)
    bodies = draw_bodies(fit.likelihood, felt, fit.mode, rng, settings.num_samples)
    bodies = bodies._replace(pi=solid.remove_common_factor(bodies.pi, gains.common_sd, rng))
    after, _ = fit.likelihood.estimate_gains(fit.mode.load)
    counts = np.maximum(fit.statistics.counts, 1.0)
    single = fit.statistics.sum_squares(fit.weights) / counts
    belief = PayloadBelief(
        source=evidence.source,
        analysis=evidence.analysis,
        bodies=bodies,
        prior_bodies=solid.draw_parameters(rng, _NUM_PRIOR_BODIES),
        channel_names=evidence.channel_names,
        unit=evidence.kind.unit,
        gains=after,
        load_friction=after[:, 1] / after[:, 0],
        noise_sd=np.sqrt(single),
        agreement=fit.long_run_variance / np.maximum(single, np.finfo(float).tiny) / evidence.rate,
        assumptions=list_assumptions(evidence, gains, settings),
        notes=evidence.notes,
        calibration=calibration,
        reference_mass=reference_mass,
    )
    if seen is not None:
        placed = seen.place(np.eye(4) if X_GT is None else X_GT)
        belief = _see(belief, fit, placed, gains, deviation_sd, settings, rng)
    return Identification(belief, fit, gains)


def _see(
    belief: PayloadBelief,
    fit: PayloadFit,
    placed: PlacedObject,
    gains: Gains,
    deviation_sd: float,
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> PayloadBelief:
    """Returns the belief updated by the seen object; with a note instead if another object is held."""
    try:
        parts = infer_parts(
            fit.likelihood,
            placed,
            deviation_sd=deviation_sd,
            unseen_share=settings.unseen_share,
            common_gain_sd=gains.common_sd,
            rng=rng,
            num_samples=settings.num_samples,
        )
    except NotTheSeenObjectError as error:
        return replace(belief, notes=(*belief.notes, f"{error}; the camera is left out"), p_value=error.p_value)
    return replace(
        belief,
        bodies=parts.bodies,
        prior_bodies=placed.draw_parameters(rng, _NUM_PRIOR_BODIES, settings.unseen_share),
        seen=parts.belief,
        likelihood=parts.likelihood,
        p_value=parts.p_value,
    )
