"""Quantities that a run left undetermined, in words."""

from collections.abc import Iterator

import numpy as np

from affordance.arrays import Array
from affordance.identification.posterior.marginals import COM, MASS, MOMENTS, QUANTITIES, Marginals, describe_bodies

# A quantity is undetermined if its SD exceeds this share of the prior's.
UNSEEN = 0.8


def find_hidden_direction(bodies: Array, weights: Array, prior_bodies: Array) -> Array | None:
    """Finds the direction along which the centre of mass is hardly better known than before a run, shape (3,).

    Args:
        bodies: Samples of the ten parameters, shape (N, 10).
        weights: Weights of the samples, shape (N,).
        prior_bodies: Samples of the prior, shape (M, 10).

    Returns: A unit vector; None if all directions are known.
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
    """Describes the hidden quantities, a sentence each.

    Args:
        m: Marginals after the run.
        share: Standard deviations as shares of the prior's, shape (10,).
        hidden: Hidden quantities, by their names in QUANTITIES.
        prior_bodies: Samples of the prior, shape (M, 10).
        is_light: True if little or nothing is held.
        is_at_rest: True if the arm was held in postures.
        direction: Direction along which the centre of mass is not known; None if there is none.
    """
    for name, part in (("mass", MASS), ("centre of mass", COM), ("moments of inertia", MOMENTS)):
        of_part = [i for i in range(part.start, part.stop) if QUANTITIES[i] in hidden]
        if part is COM and direction is not None and len(of_part) < 3:
            x, y, z = direction
            yield f"centre of mass along ({x:.2f}, {y:.2f}, {z:.2f}): no more is known than before the run"
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
            reason = "no arm at rest shows them, the prior decides"
        elif share[worst] > UNSEEN:
            moves = "is held in too few or too similar postures" if is_at_rest else "moves too slowly or too briefly"
            reason = f"{moves} to see, the prior decides"
            ranges = f"{ranges}, SD {100 * share[worst]:.0f} % of the prior's"
        elif part is MASS:
            reason = "little or nothing is held" if is_light else "no larger than the errors of the runs"
        else:
            reason = "known to a factor only"
        yield f"{name} ({', '.join(QUANTITIES[i] for i in of_part)}): {reason} ({ranges})"
