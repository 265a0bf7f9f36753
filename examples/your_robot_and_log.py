"""Your robot and your log: identifies a payload. Here both are simulated, so that the true payload is known.

Prints:

    0.79 kg (0.77 to 0.80); truly 0.80 kg
    centre of mass in cm: [12.6  0.   1. ] truly [12.  0.  1.]
"""

import tempfile
from pathlib import Path

import numpy as np

from affordance import MODELS, Runs, identify, load_robot, read_run

robot = load_robot(MODELS / "arm.dmd.yaml", "hand_grip")
MASS, CENTRE = 0.8, np.array([0.12, 0.0, 0.01])  # true payload, which is not in the log, [kg] and [m]
moments = np.diag([0.0004, 0.002, 0.002]) + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
load = np.array([MASS, *MASS * CENTRE, *np.diag(moments), moments[0, 1], moments[0, 2], moments[1, 2]])


def write_log(path: Path, pi: np.ndarray) -> None:
    """Writes a log of a 20 s motion of slow sines: joint angles, and torques with an error of 0.05 N m."""
    rng, n = np.random.default_rng(0), robot.num_joints
    times, omega = np.arange(0.0, 20.0, 0.01), 2.0 * np.pi * np.linspace(0.1, 0.3, n)
    phase = np.outer(times, omega)
    q, v, vdot = 0.4 * np.sin(phase), 0.4 * omega * np.cos(phase), -0.4 * omega**2 * np.sin(phase)
    tau = robot.compute_link_regressors(q, v, vdot) @ robot.link_parameters.ravel()
    tau += robot.compute_payload_regressors(q, v, vdot) @ pi + 0.05 * rng.standard_normal((len(times), n))
    names = ["time", *(f"{signal}_{joint + 1}" for signal in ("q", "v", "tau") for joint in range(n))]
    rows = np.column_stack([times, q, v, tau])
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="")
    joints = ", ".join(robot.joint_names)
    path.with_suffix(".yaml").write_text(f"joints: [{joints}]\nsignal: joint_torque\n", encoding="utf-8")


with tempfile.TemporaryDirectory() as folder:
    empty, loaded = Path(folder) / "empty.csv", Path(folder) / "loaded.csv"
    write_log(empty, np.zeros(10))
    write_log(loaded, load)
    belief = identify(robot, Runs(read_run(loaded), (read_run(empty),)))
low, high = belief.mass_interval90
print(f"{belief.mass:.2f} kg ({low:.2f} to {high:.2f}); truly {MASS:.2f} kg")
print("centre of mass in cm:", np.round(100.0 * belief.centre_of_mass, 1) + 0.0, "truly", 100.0 * CENTRE)
