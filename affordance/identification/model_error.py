"""What does not average out: how much an empty hand seems to hold, from one stretch of time to another.

The error of an arm's model depends on where the arm is, not on chance: over ten seconds an empty Panda seems to hold
as much as over two. So it is found from stretches of empty runs, each predicted by an arm fitted to the others, and
added to every identification as a phantom: a mass of unknown sign somewhere near the tip.
"""

import numpy as np

from affordance.arrays import Array
from affordance.identification.joint_statistics import ChannelSamples
from affordance.identification.payload_likelihood import Quadratic
from affordance.identification.preparation import PreparedRun
from affordance.identification.robot_chain import RobotChain
from affordance.objects.inertia import NUM_PARAMETERS

# The phantom lies so far from the tip, one SD in each direction, [m].
_REACH_SD = 0.15
# A phantom as broad as this is no prior: the regression of link errors on the payload wants some, [kg].
_BROAD_MASS = 10.0
# Standard deviations of its mass that are compared, evenly in the logarithm, as nothing is known of its size, [kg].
_SMALLEST, _LARGEST, _NUM_SIZES = 1e-3, 1.0, 60


def build_phantom_covariance(mass_sd: float) -> Array:
    """Covariance of the ten parameters of a mass of unknown sign near the tip, shape (10, 10)."""
    a = _REACH_SD**2
    C = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
    C[0, 0] = 1.0
    C[1:4, 1:4] = a * np.eye(3)
    # Of y^2 + z^2 and its like, with y and z normal.
    C[0, 4:7] = C[4:7, 0] = 2.0 * a
    C[4:7, 4:7] = a**2 * (6.0 * np.ones((3, 3)) + 2.0 * np.eye(3))
    C[7:, 7:] = a**2 * np.eye(3)
    return mass_sd**2 * C


def project_link_errors(robot: RobotChain, prepared: PreparedRun, samples: ChannelSamples, root: Array) -> Array:
    """Covariance of the payload that errors of the links look like, by least squares along a motion, (10, 10).

    Args:
        robot: The arm.
        prepared: The motion.
        samples: Of the payload along it.
        root: Square root of the covariance of the links' parameters, L L^T, shape (10 n, 10 n).
    """
    Y = (samples.Y * samples.used[..., None]).reshape(-1, NUM_PARAMETERS)
    W = robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot) * samples.used[..., None]
    broad = np.linalg.inv(build_phantom_covariance(_BROAD_MASS))
    seen_as = np.linalg.solve(Y.T @ Y + broad, Y.T @ W.reshape(len(Y), -1)) @ root
    covariance: Array = seen_as @ seen_as.T
    return covariance


def estimate_phantom_mass(stretches: list[Quadratic]) -> float:
    """Estimates the phantom's mass from what empty stretches seem to hold, [kg].

    Each stretch is p(signals | delta) with delta ~ N(0, s^2 C); s is found by Bayes' rule, and the square root of the
    mean of s^2 is returned, so that few stretches give a larger one.

    Args:
        stretches: Likelihood of the ten parameters of each.
    """
    sizes = np.geomspace(_SMALLEST, _LARGEST, _NUM_SIZES)
    log_evidence = np.zeros(_NUM_SIZES)
    for i, size in enumerate(sizes):
        root = np.linalg.cholesky(build_phantom_covariance(float(size)))
        for stretch in stretches:
            M = np.eye(NUM_PARAMETERS) + root.T @ stretch.precision @ root
            f = root.T @ stretch.information
            log_evidence[i] += 0.5 * f @ np.linalg.solve(M, f) - 0.5 * np.linalg.slogdet(M)[1]
    weights = np.exp(log_evidence - log_evidence.max())
    return float(np.sqrt(np.average(sizes**2, weights=weights)))
