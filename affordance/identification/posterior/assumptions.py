"""Assumptions of an identification as sentences, reported with its result."""

import numpy as np

from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.settings import IdentificationSettings, SignalKind


def list_assumptions(evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> tuple[str, ...]:
    """Lists the assumptions about everything but the payload."""
    prior = settings.get_prior(evidence.kind)
    unit = evidence.kind.unit
    sentences = [f"signal: {evidence.kind.value.replace('_', ' ')} [{unit}]; {evidence.analysis}"]
    sentences.append(f"gains: {gains.source}" if settings.gains else "gains: exact (switched off)")
    if evidence.kind is not SignalKind.WRENCH:
        if prior.load_friction_sd > 0.0 or gains.mean[:, 1].any():
            mu = ", ".join(f"{value:.3f}" for value in gains.load_friction)
            sentences.append(f"friction that grows with the load: mu = {mu} before this run")
        else:
            sentences.append("friction that grows with the load: none")
        friction = f"+-{evidence.friction_scale * prior.friction_sd:g} {unit}"
        sentences.append(
            f"friction (direction, velocity) and offset: {friction}" if settings.friction else "friction: none (off)"
        )
        sentences.append(f"samples of a joint slower than {settings.min_speed:g} rad/s are left out")
    else:
        sentences.append(f"offsets: +-{evidence.friction_scale * prior.friction_sd:g} N, a tenth of that in N m")
    phantom = 1e3 * float(np.sqrt(evidence.phantom_covariance[0, 0]))
    if phantom > 0.0:
        sentences.append(f"error of the arm's model that does not average out: {phantom:.0f} g at the tip")
    else:
        sentences.append(
            "error of the arm's model: none, it cancels" if evidence.is_difference else "none of the model"
        )
    sentences.append(
        f"errors agree over the time the residual says, in blocks of {settings.block:g} s"
        if settings.correlated_noise
        else "errors of all samples are independent (switched off)"
    )
    sentences.append(f"signals low-passed alike at {evidence.cutoff:.1f} Hz, forwards and backwards")
    return tuple(sentences)
