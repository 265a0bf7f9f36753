"""Sentences about the quantities that a run left undetermined."""

from collections.abc import Iterator

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.posterior.marginals import (
    COM,
    MASS,
    MOMENTS,
    QUANTITIES,
    Marginals,
    describe_bodies,
)

# A quantity is undetermined if its SD exceeds this share of its prior SD.
UNSEEN = 0.8


def find_hidden_direction(bodies: Array, weights: Array, prior_bodies: Array) -> Array | None:
    """Finds a direction along which the centre of mass is hardly better known than before a run, shape (3,).

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
    """Describes the undetermined quantities, one sentence each.

    Args:
        m: Marginals after the run.
        share: Standard deviations as shares of the prior's, shape (10,).
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
            yield f"centre of mass along ({x:.2f}, {y:.2f}, {z:.2f}): the run shows nothing"
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
