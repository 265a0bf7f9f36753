"""Finds reasons to doubt a weighing.

A doubt is another cause that explains the wrenches much better than a load, gains and constant offsets do.
"""

import itertools
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.extensions.payload.weighing.bayes import Regression, regress
from affordance.extensions.payload.weighing.poses import Poses
from affordance.extensions.payload.weighing.wrench_model import (
    GAIN_SD,
    GRAVITY,
    WrenchModel,
    compute_residual,
    sum_evidence,
)

DOUBTED = float(np.log(100.0))  # log odds above which another cause is reported
# Prior SDs of other causes: misaligned axes, relative to the load, and the share of the previous pose that remains.
_TURNED_SD, _LAG_SD = 0.3, 0.3
_ANGLE = 3.0  # angle from which the sensor counts as turned against the orientations, [deg]
_UNEXPLAINED = 0.5  # largest unexplained share of the forces' variation, as in ``identify``
# Lever arm that exceeds any real load's, [m], and force that exceeds any sensor's noise, [N].
_TOO_FAR, _NOISE = 1.0, 1.0
_LENGTH_SPREAD = 0.03  # largest relative difference of an accelerometer's readings
_FAR = 5.0 * np.sqrt(2.0) * GAIN_SD  # difference of two axes' gains that is reported, as in ``identify``
_SURE = 3.0  # SDs from zero at which such a difference is certain


def find_doubts(poses: Poses, model: WrenchModel, fits: tuple[Regression, Regression]) -> list[str]:
    """Finds causes that explain the wrenches much better than a load does, one sentence each."""
    wrong = check_torques(model) or _find_unexplained(poses, model, fits)
    doubts = [*_compare_gains(fits), *wrong, *_check_lengths(poses)]
    plain, num = sum_evidence(fits), len(poses.counts)
    sizes = [max(float(np.sqrt((load**2).mean())), 1e-6) for load in model.loads]
    axes = np.tile(np.eye(3), (num, 1, 1))

    def vary(course: Array) -> float:
        """Computes the log evidence of offsets that vary with a time course, (N,)."""
        column = (course[:, None, None] * axes).reshape(-1, 3)
        return sum_evidence(model.fit([(column, np.full(3, size)) for size in sizes]))

    before = [(np.concatenate([load[:1], load[:-1]]) - load).reshape(-1, 1) for load in model.loads]
    entries = [np.einsum("nl,kj->njkl", load, np.eye(3)).reshape(-1, 9) for load in model.loads]
    turned = model.fit([(each, np.full(9, _TURNED_SD)) for each in entries])
    of_steps = np.array([vary((np.arange(num) >= k).astype(float)) for k in range(2, num - 1)])
    step = int(of_steps.argmax()) + 3  # number of the pose, from 1
    log_step = float(np.log(np.exp(of_steps - of_steps.max()).mean()) + of_steps.max())
    found: dict[Callable[[], str] | str, float] = {
        f"the offsets change before pose {step}: the sensor was zeroed or struck half-way": log_step,
        "the offsets drift from pose to pose: let the sensor warm up": vary(np.linspace(-1.0, 1.0, num)),
        "the wrench still shows the pose before: it is filtered; wait longer in each pose": sum_evidence(
            model.fit([(each, np.array([_LAG_SD])) for each in before])
        ),
        lambda: _describe_turn(np.eye(3) + turned[0].mean[7:].reshape(3, 3)): sum_evidence(turned),
    }
    best = max(found, key=found.__getitem__)
    if found[best] - plain > DOUBTED:
        sentence = best if isinstance(best, str) else best()
        doubts += [sentence] if sentence else []
    return doubts


def check_torques(model: WrenchModel) -> list[str]:
    """Detects variations of torque that are too large for any load.

    Causes are a wrong unit or exchanged columns.
    """
    force, torque = (float(each.reshape(-1, 3).var(axis=0).sum()) for each in model.signals)
    lever = np.sqrt(torque / max(force, _NOISE**2))
    said = f"torques vary as those of a load {lever:.0f} m away: their unit (N mm?) or columns are wrong"
    return [said] if lever > _TOO_FAR else []


def _compare_gains(fits: tuple[Regression, Regression]) -> list[str]:
    """Compares the gains of the three axes, for forces and for torques."""
    doubts = []
    for fit, word, start in ((fits[0], "mass", 1), (fits[1], "first moment", 3)):
        gains, part = 1.0 + fit.mean[start : start + 3], slice(start, start + 3)
        covariance = np.einsum("c,cij->ij", fit.weights, np.linalg.inv(fit.precisions))[part, part]
        for i, j in ((0, 1), (1, 2), (2, 0)):
            sd = np.sqrt(covariance[i, i] + covariance[j, j] - 2.0 * covariance[i, j])
            if abs(gains[i] - gains[j]) > max(_FAR, _SURE * sd):
                unit = abs(fit.mean[0]) if start == 1 else 1.0
                shown = ", ".join(f"{name} {unit * gain:.3g}" for name, gain in zip("xyz", gains, strict=True))
                doubts.append(f"the axes disagree about the {word}: {shown}{' kg' if start == 1 else ' of the mean'}")
                break
    return doubts


def _find_unexplained(poses: Poses, model: WrenchModel, fits: tuple[Regression, Regression]) -> list[str]:
    """Detects wrenches that do not follow gravity unless columns are exchanged or signs reversed."""
    gravity = GRAVITY * poses.down_S[:, :, None]
    levers = np.stack([np.cross(axis, gravity[..., 0]) for axis in np.eye(3)], axis=2)
    kinds = (("fx, fy, fz follow gravity", gravity), ("tx, ty, tz follow a load's", levers))
    for kind, (words, of_load) in enumerate(kinds):
        kept = [*range(of_load.shape[2]), -3, -2, -1]  # without gains
        X, sds = model.columns[kind][:, kept], model.sds[kind][:1, kept]
        plain, read = regress(X, model.signals[kind], sds).log_evidence, poses.wrench[:, 3 * kind :][:, :3].ravel()
        orders = {}
        for order in itertools.permutations(range(3)):
            for signs in itertools.product((1.0,), (1.0, -1.0), (1.0, -1.0)):
                turned = of_load[:, order] * np.array(signs)[:, None]
                fit = regress(np.column_stack([turned.reshape(len(read), -1), X[:, -3:]]), read, sds)
                flip = 1.0 if sum(signs) > 0.0 else -1.0  # the common sign of all three is unknown
                names = zip(order, signs, strict=True)
                axes = [f"{'+' if flip * sign > 0 else '-'}{'xyz'[axis]}" for axis, sign in names]
                orders[", ".join(axes)] = fit.log_evidence
        best = max(orders, key=orders.__getitem__)
        if orders[best] - plain > DOUBTED + np.log(len(orders)):
            return [
                f"{words} along {best}: the order, signs or axes of the columns are wrong, or the angles of a pose"
            ]
    left, force = (compute_residual(model, fits)[:, :3] ** 2).sum(), model.signals[0].reshape(-1, 3)
    share = float(left / max(((force - force.mean(axis=0)) ** 2).sum(), np.finfo(float).tiny))
    return [f"the load leaves {100.0 * share:.0f} % of the forces unexplained"] if share > _UNEXPLAINED else []


def _check_lengths(poses: Poses) -> list[str]:
    """Compares the norms of an accelerometer's readings, which are equal at rest."""
    if not len(poses.lengths) or (spread := np.ptp(poses.lengths) / poses.lengths.mean()) <= _LENGTH_SPREAD:
        return []
    return [f"the accelerometer's readings differ in length by {100.0 * spread:.0f} %: it has offsets, or it moved"]


def _describe_turn(M: Array) -> str:
    """Describes the rotation in a matrix M, (3, 3), that maps the load's forces to the measured forces.

    The text is empty if the rotation is small.
    """
    turn = Rotation.align_vectors(M.T, np.eye(3))[0].as_rotvec()
    angle = float(np.degrees(np.linalg.norm(turn)))
    if angle < _ANGLE:
        return ""
    shown = ", ".join(f"{value:.1f}" for value in turn / np.linalg.norm(turn))
    return f"the sensor's axes are turned by about {angle:.0f} deg about ({shown}) against the orientations"
