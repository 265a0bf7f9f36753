"""Infers a payload from the evidence of a run, and lists the assumptions."""

from dataclasses import replace

import numpy as np

from affordance.extensions.payload.evidence.evidence import Evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.posterior.body_posterior import draw_bodies, spread_bodies
from affordance.extensions.payload.posterior.part_posterior import NotTheSeenObjectError, PlacedObject, infer_parts
from affordance.extensions.payload.posterior.payload_belief import SURPRISE, PayloadBelief
from affordance.extensions.payload.posterior.payload_fit import (
    add_friction_error,
    build_channel_prior,
    fit_payload,
    spread_gains,
    vary_unknowns,
)
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind

_NUM_PRIOR_BODIES = 1000
_ODD = 0.05  # p-value below which the belief gets a note


def infer(
    evidence: Evidence,
    gains: Gains,
    *,
    solid: SolidPrior | None = None,
    placed: PlacedObject | None = None,
    deviation: float = 0.06,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> PayloadBelief:
    """Infers the posterior of a payload from the evidence of a run.

    If the run does not fit the object that a camera saw, the camera is ignored and a note is added.

    Args:
        evidence: Evidence of the run, from any analysis.
        gains: Gains before this run, including drift.
        solid: Prior of an unseen body; None for a broad prior over solids that a hand can hold.
        placed: Object that a camera saw, in the frame of the tip; None without a camera.
        deviation: SD of an object's density about its material's mean, as a fraction of the mean.
        settings: Settings of the identification.

    Returns: Posterior with samples of the ten inertial parameters in the frame of the tip.
    """
    evidence = replace(evidence, least_variance=np.maximum(evidence.least_variance, gains.least_variance))
    solid = SolidPrior.for_hand() if solid is None else solid
    # Torques determine the body only up to the unknown common factor of all gains.
    felt = solid.with_common_factor(gains.common_sd)
    evidence = add_friction_error(evidence, gains, felt, settings)
    fit = fit_payload(evidence, build_channel_prior(evidence, gains, settings), felt, settings)
    spreads = spread_gains(fit)
    middle = 1.0 / float(np.mean(1.0 / spreads))
    if evidence.kind is SignalKind.WRENCH:
        gains = replace(gains, covariance=middle * gains.covariance)
        fit = fit_payload(evidence, build_channel_prior(evidence, gains, settings), felt, settings)
    rng = np.random.default_rng(settings.seed)
    bodies = draw_bodies(fit.likelihood, felt, fit.mode, rng, settings.num_samples)
    if evidence.kind is SignalKind.WRENCH or not evidence.is_at_rest:
        bodies = spread_bodies(bodies, vary_unknowns(fit, spreads / middle, settings), felt, fit.mode, rng)
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
        load_friction=replace(gains, mean=after).load_friction,
        noise_sd=np.sqrt(single),
        agreement=fit.long_run_variance / np.maximum(single, np.finfo(float).tiny) / evidence.rate,
        assumptions=list_assumptions(evidence, gains, settings),
        notes=evidence.notes,
        fit=fit,
    )
    if placed is None:
        return belief
    try:
        parts = infer_parts(
            fit.likelihood,
            placed,
            deviation=deviation,
            unseen_share=settings.unseen_share,
            common_gain_sd=gains.common_sd,
            rng=rng,
            num_samples=settings.num_samples,
        )
    except NotTheSeenObjectError as error:
        return replace(belief, notes=(*belief.notes, f"{error}; the camera is ignored"), p_value=error.p_value)
    if parts.p_value < SURPRISE:
        left_out = "the camera is ignored: the run is too improbable for the object that it saw"
        return replace(belief, notes=(*belief.notes, left_out), p_value=parts.p_value)
    if parts.p_value < _ODD:
        odd = f"p = {parts.p_value:.2g}: few objects that are what they look like would give such an improbable run"
        belief = replace(belief, notes=(*belief.notes, odd))
    return replace(
        belief,
        bodies=parts.bodies,
        prior_bodies=placed.draw_parameters(rng, _NUM_PRIOR_BODIES, settings.unseen_share),
        seen=parts.belief,
        likelihood=parts.likelihood,
        felt=parts.felt,
        p_value=parts.p_value,
    )


def list_assumptions(evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> tuple[str, ...]:
    """Lists the assumptions about the arm, its signals and their errors, one sentence each."""
    prior = settings.get_prior(evidence.kind)
    unit = evidence.kind.unit
    sentences = [f"signal: {evidence.kind.value.replace('_', ' ')} [{unit}]; {evidence.analysis}"]
    sentences.append(f"gains: {gains.source}")
    if evidence.is_difference and prior.change_common_sd > 0.0:
        together, each = 100.0 * prior.change_common_sd, 100.0 * prior.change_own_sd
        sentences.append(f"change of gains since the empty run: +-{together:g} % in common and +-{each:g} % each")
    if evidence.kind is not SignalKind.WRENCH:
        if prior.load_friction_sd > 0.0 or gains.mean[:, 1].any():
            mu = ", ".join(f"{value:.3f}" for value in gains.load_friction)
            sentences.append(f"friction that grows with the load: mu = {mu} before this run")
        else:
            sentences.append("friction that grows with the load: none")
        friction = f"+-{evidence.friction_scale * prior.friction_sd:g} {unit}"
        if (left := evidence.friction_left) is not None:
            friction = (
                f"+-{left[:, 0].min():.2g} to {left[:, 0].max():.2g} {unit} after the fit, and offset {friction}"
            )
        sentences.append(f"friction (direction, velocity) and offset: {friction}")
        if not evidence.is_at_rest:
            sentences.append(f"samples of a joint slower than {settings.min_speed:g} rad/s are left out")
        elif evidence.kind is not SignalKind.JOINT_TORQUE:
            sentences.append("friction at rest bears part of the load, in a random direction")
    else:
        sentences.append(f"offsets: +-{evidence.friction_scale * prior.friction_sd:g} N, and a tenth of that in N m")
    phantom = 1e3 * float(np.sqrt(evidence.phantom_covariance[0, 0]))
    if phantom > 0.0:
        sentences.append(
            f"error of the arm and friction models that does not average out: {phantom:.2g} g at the tip"
        )
    else:
        sentences.append(
            "error of the arm's model: none, it cancels"
            if evidence.is_difference
            else "error of the arm's model: none"
        )
    if evidence.is_at_rest:
        sentences.append(f"{len(evidence.prepared.times)} postures held at rest; their errors are independent")
        return tuple(sentences)
    between = " and from one to the next" if evidence.kind is SignalKind.WRENCH else ""
    sentences.append(
        f"errors are correlated over a time estimated from the residual, in blocks of {settings.block:g} s{between}"
        if settings.correlated_noise
        else "errors of all samples are independent (switched off)"
    )
    sentences.append(f"all signals low-pass filtered at {evidence.prepared.cutoff:.1f} Hz, forwards and backwards")
    return tuple(sentences)
