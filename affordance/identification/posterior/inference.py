"""Inference of a payload from evidence, whatever the runs and the analysis that it comes from."""

from dataclasses import replace

import numpy as np

from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.posterior.assumptions import list_assumptions
from affordance.identification.posterior.body_posterior import draw_bodies
from affordance.identification.posterior.part_posterior import NotTheSeenObjectError, PlacedObject, infer_parts
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.settings import DEFAULT_SETTINGS, IdentificationSettings

_NUM_PRIOR_BODIES = 1000


def infer(
    evidence: Evidence,
    gains: Gains,
    *,
    solid: SolidPrior | None = None,
    placed: PlacedObject | None = None,
    deviation_sd: float = 100.0,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> PayloadBelief:
    """Infers the belief about a payload from evidence.

    Args:
        evidence: Evidence of a loaded run.
        gains: Gains for this run, drift included.
        solid: Prior of a body that no camera has seen; None for any solid that a hand could hold.
        placed: Object that a camera saw, in the frame of the tip; None without a camera.
        deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].
        settings: Settings of nuisances and samples.
    """
    evidence = replace(evidence, least_variance=np.maximum(evidence.least_variance, gains.least_variance))
    solid = SolidPrior.for_hand() if solid is None else solid
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
        fit=fit,
    )
    return belief if placed is None else _see(belief, placed, gains, deviation_sd, settings, rng)


def _see(
    belief: PayloadBelief,
    placed: PlacedObject,
    gains: Gains,
    deviation_sd: float,
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> PayloadBelief:
    """Returns the belief updated by the seen object; with a note instead if another object is held."""
    try:
        parts = infer_parts(
            belief.fit.likelihood,
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
