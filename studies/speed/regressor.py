"""Times the payload regressor along 300 samples, compared with Pinocchio's C++ regressor called in a loop.

Pinocchio computes the columns of all bodies, of which only the last ten are used. It has no joint-torque regressor
for a single body.
"""

import numpy as np
import pinocchio

from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import load_arm
from studies.speed.peer_arms import build_pinocchio
from studies.speed.timing import time_by_turns

NUM_SAMPLES = 300
HEADER = ["payload regressor", "ms for 300 samples", "time divided by Pinocchio's"]


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Times each way to compute the regressor; returns the rows of a table, and our time divided by Pinocchio's."""
    arm = load_arm()
    chain, model = build_chain(arm), ArmModel(arm)
    other = build_pinocchio()
    data = other.createData()
    q, v, vdot = np.random.default_rng(0).normal(size=(3, NUM_SAMPLES, arm.num_joints))
    x = np.hstack([q, v])

    def loop_pinocchio() -> None:
        for k in range(NUM_SAMPLES):
            pinocchio.computeJointTorqueRegressor(other, data, q[k], v[k], vdot[k])

    def loop_drake() -> None:
        for k in range(NUM_SAMPLES):
            compute_payload_regressor(model, x[k], vdot[k])

    times = time_by_turns(
        {
            "ours, all samples at once": lambda: chain.compute_payload_regressors(q, v, vdot),
            "Pinocchio, C++, in a loop": loop_pinocchio,
            "ours, one sample a call": loop_drake,
        },
        calls_per_turn=5,
    )
    reference = times["Pinocchio, C++, in a loop"]
    rows = [[name, f"{1e3 * value:.2f}", f"{value / reference:.2f}"] for name, value in times.items()]
    return rows, {"regressor_vs_pinocchio": times["ours, all samples at once"] / reference}
