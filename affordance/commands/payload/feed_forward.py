"""``affordance feed-forward``: computes the gravity torque at each joint of a robot with a payload."""

import argparse

import numpy as np

from affordance.arguments import check_number
from affordance.commands import answers
from affordance.exceptions import BadValueError
from affordance.extensions.payload.payload_comparison import read_estimate
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.load import HAND_FRAME
from affordance.reporting.formatting import tabulate

_GRAVITY = 9.81  # [m/s^2]


def run(arguments: argparse.Namespace) -> int:
    """Prints the torques that hold a posture, with their errors. Returns the exit status."""
    check_number("--link-error", arguments.link_error, 0.0, 1.0)
    payload = None if arguments.payload is None else read_estimate(arguments.payload)
    frame = payload.frame if payload is not None else ""
    if arguments.tip and frame and arguments.tip != frame:
        raise BadValueError(
            "--tip", "", f"is {arguments.tip!r}, must be the payload's frame, {frame} (weigh --frame names it)"
        )
    robot = load_robot(arguments.robot or MODELS, arguments.tip or frame or HAND_FRAME)
    n = robot.num_joints
    if arguments.posture is None or len(arguments.posture) != n:
        given = "is missing" if arguments.posture is None else f"has {len(arguments.posture)} angles"
        raise BadValueError("--posture", "", f"{given}, must have {n}: {', '.join(robot.joint_names)}")
    if not np.isfinite([*arguments.posture, *arguments.gravity]).all() or not np.any(arguments.gravity):
        raise BadValueError("--posture", "", "has an angle or --gravity a number that is not finite, must be finite")
    down = np.array(arguments.gravity) / np.linalg.norm(arguments.gravity)
    robot = robot.with_gravity(_GRAVITY * down)
    q, rest = np.array([arguments.posture]), np.zeros((1, n))
    of_arm = robot.compute_arm_torques(q, rest, rest)[0]
    of_links = robot.compute_link_regressors(q, rest, rest)[0].reshape(n, n, NUM_PARAMETERS)
    each_link = np.einsum("jlp,lp->jl", of_links, robot.link_parameters)
    variance = (arguments.link_error * each_link) ** 2
    of_payload, payload_variance = np.zeros(n), np.zeros(n)
    if payload is not None:
        k = min(len(payload.mean), 4)  # at rest, moments of inertia cause no torque
        Y = robot.compute_payload_regressors(q, rest, rest)[0][:, :k]
        of_payload = Y @ payload.mean[:k]
        payload_variance = np.einsum("jp,pq,jq->j", Y, payload.covariance[:k, :k], Y)
    sds = np.sqrt(np.stack([variance.sum(axis=1), payload_variance, variance.sum(axis=1) + payload_variance]))
    torques = np.stack([of_arm, of_payload, of_arm + of_payload])
    rows: list[tuple[str, ...]] = [("joint", "angle (rad)", "arm (N m)", "SD", "payload", "SD", "sum", "SD")]
    for j, name in enumerate(robot.joint_names):
        cells = [f"{x:.3f}" for pair in zip(torques[:, j], sds[:, j], strict=True) for x in pair]
        rows.append((name, f"{arguments.posture[j]:g}", *cells))
    text = "\n".join(
        [
            f"Torques that hold {'the empty arm' if payload is None else payload.name} at rest against gravity",
            *tabulate(rows, right=range(1, 8)),
            f"Assumed: each link's weight is right to {100.0 * arguments.link_error:g} % (--link-error); no friction",
        ]
    )
    content = {"joints": list(robot.joint_names), "angle": arguments.posture}
    for name, torque, sd in zip(("arm", "payload", "sum"), torques, sds, strict=True):
        content |= {f"{name}_nm": torque.tolist(), f"{name}_sd_nm": sd.tolist()}
    answers.print_answer(arguments, text, content)
    return 0 if payload is None or payload.is_trusted else 3
