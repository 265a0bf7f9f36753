"""Checks the description of a run against the torques due to the arm's own weight.

A robot's file predicts these torques to within a factor of two, whatever the payload. If the signals fit them much
better with the opposite sign, with another direction of gravity, in another frame or after a time shift, the
description is wrong. If the signals are close to zero, the controller has subtracted the torques.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask
from affordance.extensions.payload.evidence.wrist_sensor import compute_force_regressors, measure_angle
from affordance.extensions.payload.recording.preparation import PreparedRun, prepare
from affordance.extensions.payload.recording.run import Run, resample
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Largest number of samples that are compared, and smallest number for a joint.
_MOST, _FEWEST = 500, 12
# Least factor by which another direction of gravity, or a time shift, must reduce the residual variance to be
# accepted (geometric mean over joints). In windows of recordings of a UR10e and a Panda, no alternative reaches 1.2.
_BETTER = 3.0
# Share of a joint's variance beyond friction that the arm's own weight must explain before the sign of the signal is
# judged, and ratio of signal to own-weight torque below which that torque is missing from the signal.
_EXPLAINED, _LACKS = 0.8, 0.2
# Least standard deviation of a joint's own-weight torque, relative to the largest, at which the joint is judged.
_JUDGED = 0.2
_LAGS = np.linspace(-0.15, 0.15, 31)  # candidate delays of the signals, [s]
_WRENCH_LAGS = np.linspace(-2.0, 2.0, 81)  # the same for a wrist sensor, whose filter may be slow, [s]
_LEAST_LAG, _LAGS_AGREE = 0.02, 0.03  # least delay, and largest difference between joints, [s]
# Standard errors by which a gain must differ from zero for its sign to be certain, and correlation time of errors,
# [s].
_SURE, _AGREEMENT = 4.0, 1.0
# Angle above which the description of gravity or of a frame is wrong, not merely imprecise, [rad].
_TURNED = np.radians(20.0)
_AXES = np.concatenate([np.eye(3), -np.eye(3)])
_AXIS_NAMES = ("+x", "+y", "+z", "-x", "-y", "-z")
_ALONG = np.cos(np.radians(5.0))


def find_contradictions(robot: SerialChain, run: Run, settings: IdentificationSettings) -> tuple[str, ...]:
    """Finds contradictions between a run and its description.

    Args:
        robot: Arm.
        run: Recorded run, with its joints in the order of the arm's joints.
        settings: Settings of filters.

    Returns: One sentence per contradiction.
    """
    robot = robot.with_gravity(run.description.gravity)
    if run.description.kind is SignalKind.WRENCH:
        return (*_compare_wrench(robot, run), *_find_wrench_lag(robot, run, settings))
    prepared = prepare(run, settings)
    every = max(1, len(prepared.times) // _MOST)
    thin = prepared.select(slice(None, None, every))
    used = np.abs(thin.v) >= (0.0 if run.description.postures else settings.min_speed)
    if (used.sum(axis=0) < _FEWEST).all():
        return ()
    return _compare_joints(robot, run, prepared, thin, used)


def _compare_joints(
    robot: SerialChain, run: Run, prepared: PreparedRun, thin: PreparedRun, used: Mask
) -> tuple[str, ...]:
    """Checks gravity, signs, compensation and delay of joint signals."""
    length = float(np.linalg.norm(robot.gravity_W))
    directions = np.concatenate([robot.gravity_W[None] / length, _AXES])
    fits = [_fit(robot.with_gravity(length * each), thin, thin.signal, used) for each in directions]
    judged = _judge(fits[0])
    if not judged.any():
        return ()
    # Another direction of gravity may load other joints, so the joints that each candidate loads are judged too.
    left = np.array([np.log(fit.left[_judge(fit) | judged]).mean() for fit in fits])
    # Opposite directions fit equally well, with opposite gains. The direction closer to the described one is chosen.
    near = directions @ directions[0] > -0.5
    best = int(np.argmin(np.where(near, left, np.inf)))
    found: list[str] = []
    gravity = robot.gravity_W
    if left[best] < left[0] - np.log(_BETTER) and measure_angle(directions[best], directions[0]) > _TURNED:
        signs = np.sign(fits[best].gain[_judge(fits[best])])
        direction = directions[best] * (1.0 if signs.sum() >= 0.0 else -1.0)
        gravity = length * direction
        found.append(f"gravity seems to be along {describe_direction(direction)} of the base")
        fits[best] = _fit(robot.with_gravity(gravity), thin, thin.signal, used)
    else:
        best = 0
    fit = fits[best]
    judged = _judge(fit)
    if run.description.kind is not SignalKind.CURRENT and (
        subtracted := _find_subtracted(robot.with_gravity(gravity), thin, used)
    ):
        if run.description.compensates_arm:
            return ()
        return (f"the signals lack the arm's own weight: the controller has subtracted {subtracted}",)
    if run.description.compensates_arm:
        follows = judged & (fit.explained > _EXPLAINED) & (fit.gain > 0.5)
        if not follows.any() or not follows[judged].all() or run.description.kind is SignalKind.CURRENT:
            return ()
        return ("the signals contain the arm's own weight, although 'compensates' says it was subtracted",)
    turned = judged & (fit.explained > _EXPLAINED) & (fit.gain < -_SURE * fit.error)
    if turned.any():
        found.append(_describe_signs(robot, turned, judged))
    lag = _find_lag(robot.with_gravity(gravity), prepared, thin, used)
    if lag:
        words = f"{1e3 * abs(lag):.0f} ms {'late' if lag > 0.0 else 'early'}"
        found.append(f"the signals are {words} relative to the joint angles")
    return tuple(found)


def _describe_signs(robot: SerialChain, turned: Mask, judged: Mask) -> str:
    """Describes joints whose signal has the opposite sign."""
    if turned[judged].all() and judged.sum() > 1:
        return (
            "all joints have the opposite sign, as is KUKA's convention: the signal falls where the arm's own weight "
            "pulls more, or gravity points the other way"
        )
    names = ", ".join(np.array(robot.joint_names)[turned])
    have = "have" if turned.sum() > 1 else "has"
    return f"{names} {have} the opposite sign: the signal falls where the arm's own weight pulls more"


class _Fit(NamedTuple):
    """Regression of each joint's signal on own-weight torque and friction, (n,) each."""

    gain: Array  # signal per torque
    error: Array  # standard error of the gain
    left: Array  # residual variance
    explained: Array  # share of the variance beyond friction that the arm's own weight explains
    torque_sd: Array  # standard deviation of the own-weight torque


def _fit(robot: SerialChain, thin: PreparedRun, signal: Array, used: Mask) -> _Fit:
    """Regresses joint signals, (N, n), on own-weight torque, friction and an offset.

    The friction terms are Coulomb, viscous and proportional to the load.
    """
    torque = robot.compute_arm_torques(*thin.motion)
    n = torque.shape[1]
    values = np.zeros((5, n))
    values[2] = 1.0
    alike = 1.0 if not thin.v.any() else max(_AGREEMENT * thin.rate, 1.0)  # number of samples with correlated errors
    for j in range(n):
        rows = used[:, j]
        if rows.sum() < _FEWEST:
            continue
        v, tau, x = thin.v[rows, j], torque[rows, j], signal[rows, j]
        friction = _build_friction(v)
        without = x - friction @ np.linalg.lstsq(friction, x)[0]
        own = np.column_stack([tau, np.abs(tau) * np.sign(v), friction])
        solution = np.linalg.lstsq(own, x)[0]
        rest = float(np.mean((x - own @ solution) ** 2))
        beyond = float(np.mean(without**2))
        least = 1e-6 * max(float(x @ x) / len(x), 1e-12)
        error = np.sqrt(max(np.linalg.pinv(own.T @ own)[0, 0], 0.0) * rest * alike)
        explained = 1.0 - rest / max(beyond, least)
        values[:, j] = solution[0], error, max(rest, least), explained, tau.std()
    return _Fit(*values)


def _build_friction(v: Array) -> Array:
    """Builds the regressor of Coulomb friction, viscous friction and offset, (N, 3), from velocities, (N,)."""
    return np.column_stack([np.sign(v), v, np.ones_like(v)])


def _find_subtracted(robot: SerialChain, thin: PreparedRun, used: Mask) -> str:
    """Finds own-weight torques that a controller has subtracted from the signals.

    After friction and the inertia of the links are fitted, such signals vary much less than the gravity torque.

    Returns: A description of the subtracted torques; empty if the signals contain the arm's own weight.
    """
    rest = np.zeros_like(thin.v)
    gravity = robot.compute_arm_torques(thin.q, rest, rest)
    inertia = robot.compute_arm_torques(*thin.motion) - gravity
    size, weight, felt, along = np.zeros((4, gravity.shape[1]))
    for j in range(gravity.shape[1]):
        rows = used[:, j]
        if rows.sum() < _FEWEST:
            continue
        both = np.column_stack([thin.signal[rows, j], gravity[rows, j]])
        A = np.column_stack([inertia[rows, j], _build_friction(thin.v[rows, j])])
        solution = np.linalg.lstsq(A, both)[0]
        size[j], weight[j] = (both - A @ solution).std(axis=0)
        felt[j] = inertia[rows, j].var()
        along[j] = felt[j] * solution[0, 0]
    judged = weight > _JUDGED * max(float(gravity.std(axis=0).max()), 1e-9)
    if not judged.any() or (size > _LACKS * weight)[judged].any():
        return ""
    has_inertia = along.sum() > 0.5 * felt.sum()
    return "it but not its inertia (compensates: gravity)" if has_inertia else "it (compensates: arm)"


def _judge(fit: _Fit) -> Mask:
    """Returns a mask of the joints with sufficiently large own-weight torque, shape (n,)."""
    judged: Mask = fit.torque_sd > _JUDGED * max(float(fit.torque_sd.max()), 1e-9)
    return judged


def _find_lag(robot: SerialChain, prepared: PreparedRun, thin: PreparedRun, used: Mask) -> float:
    """Estimates the delay of the signals, [s]. The delay is zero unless another time fits much better."""
    if not used.any() or not prepared.v.any():
        return 0.0
    inside = (thin.times >= thin.times[0] - _LAGS[0]) & (thin.times <= thin.times[-1] - _LAGS[-1])
    if inside.sum() < _FEWEST:
        return 0.0
    thin, used = thin.select(np.flatnonzero(inside)), used[inside]
    fits = [_fit(robot, thin, resample(thin.times + lag, prepared.times, prepared.signal), used) for lag in _LAGS]
    judged = _judge(fits[0]) & (np.max([fit.explained for fit in fits], axis=0) > _EXPLAINED)
    if not judged.any():
        return 0.0
    each = np.array([np.log(fit.left[judged]) for fit in fits])
    left, own = each.mean(axis=1), _LAGS[each.argmin(axis=0)]
    best = int(left.argmin())
    if np.count_nonzero(np.abs(own - _LAGS[best]) <= _LAGS_AGREE) < 2:  # errors of a short run can mimic any delay
        return 0.0
    is_inside = 0 < best < len(_LAGS) - 1
    if not is_inside or abs(_LAGS[best]) < _LEAST_LAG or left[best] > left[len(_LAGS) // 2] - np.log(_BETTER):
        return 0.0
    return float(_LAGS[best])


def _compare_wrench(robot: SerialChain, run: Run) -> tuple[str, ...]:
    """Checks the sign, gravity and mounting in a wrist sensor's description."""
    every = max(1, len(run.times) // _MOST)
    q, forces = run.q[::every], run.signal[::every, :3]
    length = float(np.linalg.norm(robot.gravity_W))
    columns = np.stack(
        [compute_force_regressors(robot.with_gravity(length * axis), q)[:, :3, 0] for axis in np.eye(3)], axis=2
    )  # (N, 3, 3): force of one kilogram with gravity along each axis
    moments = run.signal[::every, 3:]
    if _are_in_base(columns / length, compute_force_regressors(robot, q)[:, 3:, 1:4], moments):
        seems = "the wrench seems to be given along the base's axes (wrench_axes: base)"
        return (f"the moments do not turn with the sensor: {seems}",)
    varied = columns - columns.mean(axis=0)
    forces = forces - forces.mean(axis=0)
    flat, b = varied.reshape(-1, 3), forces.ravel()
    if len(q) < 4 or np.linalg.svd(flat, compute_uv=False)[-1] < _JUDGED * np.sqrt(len(q)) * length * 0.5:
        return ()
    weight = np.linalg.lstsq(flat, b)[0]
    whole = float(b @ b)
    left = float(np.sum((b - flat @ weight) ** 2)) / max(whole, 1e-30)
    described = robot.gravity_W / length
    angle = measure_angle(weight, described)
    if 1.0 - left > _EXPLAINED:
        if angle < _TURNED:
            return ()
        if angle > np.pi - _TURNED:
            return ("the forces have the opposite sign: 'force_on' or the direction of gravity is wrong",)
        direction = weight / np.linalg.norm(weight)
        nearest = _AXES[int(np.argmax(_AXES @ direction))]
        direction = nearest if nearest @ direction > np.cos(_TURNED) else direction
        return (f"gravity seems to be along {describe_direction(direction)} of the base",)
    return _compare_frame(varied @ described, forces, whole)


def _are_in_base(rotations: Array, regressors: Array, moments: Array) -> bool:
    """Returns True if the moments fit the load only when they are given along the base's axes.

    Args:
        rotations: Rotations from the base to the sensor, up to a common sign, shape (N, 3, 3).
        regressors: Moments at rest per first moment, along the sensor's axes, shape (N, 3, 3).
        moments: Recorded moments, shape (N, 3), [N m].
    """
    left, of_base = (_leave(regressors, each) for each in (moments, (rotations @ moments[..., None])[..., 0]))
    return of_base < min(1.0 - _EXPLAINED, left / _BETTER)


def _leave(regressors: Array, signal: Array) -> float:
    """Computes the share of a signal's variation that regressors do not explain.

    The shapes are (N, 3) for the signal and (N, 3, k) for the regressors.
    """
    A, b = ((each - each.mean(axis=0)).reshape(signal.size, -1) for each in (regressors, signal))
    solution = np.linalg.lstsq(A, b)[0]
    return float(np.sum((b - A @ solution) ** 2)) / max(float(np.sum(b**2)), 1e-30)


def _find_wrench_lag(robot: SerialChain, run: Run, settings: IdentificationSettings) -> tuple[str, ...]:
    """Detects a delay or advance of wrist forces relative to the joint angles."""
    if run.description.postures:
        return ()
    prepared = prepare(run, settings)
    thin = prepared.select(slice(None, None, max(1, len(prepared.times) // _MOST)))
    inside = (thin.times >= thin.times[0] - _WRENCH_LAGS[0]) & (thin.times <= thin.times[-1] - _WRENCH_LAGS[-1])
    if inside.sum() < _FEWEST:
        return ()
    thin = thin.select(np.flatnonzero(inside))
    regressors = robot.compute_wrench_regressors(*thin.motion)[:, 3:, :4]
    forces = prepared.signal[:, :3]
    left = [_leave(regressors, resample(thin.times + lag, prepared.times, forces)) for lag in _WRENCH_LAGS]
    best, unshifted = int(np.argmin(left)), left[len(left) // 2]
    is_inside = 0 < best < len(left) - 1
    if not is_inside or left[best] > min(1.0 - _EXPLAINED, unshifted / _BETTER):
        return ()
    lag = _WRENCH_LAGS[best]
    return (f"the forces are about {abs(lag):.2g} s {'late' if lag > 0.0 else 'early'} relative to the joint angles",)


def _compare_frame(expected: Array, forces: Array, whole: float) -> tuple[str, ...]:
    """Detects a rotated mounting of the sensor from its forces, (N, 3), and the expected forces, (N, 3)."""
    U, S, Vt = np.linalg.svd(forces.T @ expected)
    R = Vt.T @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ U.T  # from the sensor's frame to the tip's
    turned = forces @ R.T
    mass = float(np.sum(turned * expected) / max(np.sum(expected**2), 1e-30))
    left = float(np.sum((turned - mass * expected) ** 2)) / max(whole, 1e-30)
    angle = np.arccos(np.clip(0.5 * (np.trace(R) - 1.0), -1.0, 1.0))
    if 1.0 - left < _EXPLAINED or angle < _TURNED or S[1] < _JUDGED * S[0]:
        return ()
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if np.linalg.norm(axis) < 1e-6:  # a rotation by half a turn
        axis = np.linalg.eigh(R)[1][:, -1]
    along = describe_direction(axis / np.linalg.norm(axis))
    return (f"the sensor seems to be turned by {np.degrees(angle):.0f} deg about {along} of the tip",)


def describe_direction(direction: Array) -> str:
    """Formats a unit vector as the name of an axis or as components."""
    along = _AXES @ direction
    if along.max() > _ALONG:
        return _AXIS_NAMES[int(along.argmax())]
    return f"({', '.join(f'{value:.2f}' for value in direction)})"
