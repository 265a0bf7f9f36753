"""Estimates model errors that do not average out, from stretches of empty runs.

The error of an arm's model depends on its configuration, not on chance: the apparent payload of an empty Panda is as
large over ten seconds as over two. The error is estimated from stretches of empty runs, each predicted by an arm
fitted to the other stretches. Every identification includes the error as a phantom payload: a mass of unknown sign
somewhere near the tip.
"""

from collections.abc import Callable, Sequence

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples
from affordance.extensions.payload.evidence.payload_likelihood import PayloadLikelihood
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# SD of the phantom's position about the tip in each direction, [m].
_REACH_SD = 0.15
# Mass SD of an uninformative phantom, which regularises the projection of link errors onto the payload, [kg].
_BROAD_MASS = 10.0
# Grid of the phantom's mass SD, [kg], logarithmic because its order of magnitude is unknown.
_SMALLEST, _LARGEST, _NUM_SIZES = 1e-3, 1.0, 60
# SD of an external pull in each direction, [N]: 30 cm of a sensor cable of 60 g per metre, an assumption.
PULL = 0.2


def build_phantom_covariance(mass_sd: float) -> Array:
    """Builds the covariance of a phantom payload near the tip, (10, 10), with a given SD of its mass, [kg]."""
    a = _REACH_SD**2
    C = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
    C[0, 0] = 1.0
    C[1:4, 1:4] = a * np.eye(3)
    # Covariances of y^2 + z^2 and its permutations for normal x, y and z.
    C[0, 4:7] = C[4:7, 0] = 2.0 * a
    C[4:7, 4:7] = a**2 * (6.0 * np.ones((3, 3)) + 2.0 * np.eye(3))
    C[7:, 7:] = a**2 * np.eye(3)
    return mass_sd**2 * C


def project_link_errors(robot: SerialChain, prepared: PreparedRun, samples: ChannelSamples, root: Array) -> Array:
    """Computes the covariance of the apparent payload due to link errors, by least squares along a motion.

    Args:
        robot: Arm.
        prepared: Motion.
        samples: Samples of the motion.
        root: Square root L of the covariance L L^T of the links' parameters, shape (10 n, 10 n).

    Returns: Covariance of the payload, shape (10, 10).
    """
    W = robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot)
    seen_as = _project(samples, W) @ root
    covariance: Array = seen_as @ seen_as.T
    return covariance


def project_pulls(robot: SerialChain, prepared: PreparedRun, samples: ChannelSamples) -> Array:
    """Computes the covariance of the apparent payload due to an external pull, by least squares along a motion.

    A cable or hose pulls in a constant direction at one link of the outer half of the arm. All of these links are
    equally probable, so that several lever arms are possible.

    Returns: Covariance of the payload, shape (10, 10).
    """
    motions = list(robot.compute_link_motions(*prepared.motion))
    outer = range(len(motions) // 2, len(motions))
    covariance = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
    for link in outer:
        pull = np.zeros((*prepared.q.shape, 3))
        pull[:, : link + 1] = motions[link].Jv_V_WT[:, 3:].transpose(0, 2, 1)
        seen_as = _project(samples, pull)
        covariance += PULL**2 * seen_as @ seen_as.T / len(outer)
    return covariance


def _project(samples: ChannelSamples, columns: Array) -> Array:
    """Computes the payloads that best fit torques, (N, C, K), in least squares, shape (10, K)."""
    Y = (samples.Y * samples.used[..., None]).reshape(-1, NUM_PARAMETERS)
    broad = np.linalg.inv(build_phantom_covariance(_BROAD_MASS))
    torques = (columns * samples.used[..., None]).reshape(len(Y), -1)
    seen_as: Array = np.linalg.solve(Y.T @ Y + broad, Y.T @ torques)
    return seen_as


def estimate_phantom_mass(stretches: list[Quadratic]) -> float:
    """Estimates the SD of the phantom's mass from empty stretches, [kg].

    Each stretch has the likelihood p(signals | delta) with delta ~ N(0, s^2 C). The result is the root mean square of
    s under its posterior, which is larger if there are few stretches.
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


def estimate_sizes(
    list_stretches: Callable[[float], Sequence[PayloadLikelihood]], shares: Array
) -> tuple[float, float]:
    """Estimates the SD of the phantom's mass, [kg], and the unexplained share of friction.

    Both are root mean squares under their joint posterior, with log-uniform priors. They are larger if there are few
    stretches.

    Args:
        list_stretches: Function that builds the likelihoods of the empty stretches for a share.
        shares: Candidate shares.
    """
    sizes = np.geomspace(_SMALLEST, _LARGEST, _NUM_SIZES)
    covariance = build_phantom_covariance(1.0)
    log_evidence = np.array(
        [
            np.sum([each.compute_log_evidence(covariance, sizes) for each in list_stretches(float(share))], axis=0)
            for share in shares
        ]
    )
    weights = np.exp(log_evidence - log_evidence.max())
    weights /= weights.sum()
    mass, share = np.sqrt(weights.sum(axis=0) @ sizes**2), np.sqrt(weights.sum(axis=1) @ shares**2)
    return float(mass), float(share)
