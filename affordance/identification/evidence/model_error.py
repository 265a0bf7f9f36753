"""Model error that does not average out: the apparent payload of an empty hand in different stretches of time.

The error of an arm's model depends on its configuration, not on chance: over ten seconds an empty Panda appears to
hold as much as over two. The error is estimated from stretches of empty runs, each predicted by an arm fitted to the
others, and added to every identification as a phantom payload: a mass of unknown sign somewhere near the tip.
"""

from collections.abc import Callable, Sequence

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.identification.evidence.joint_statistics import ChannelSamples
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood
from affordance.identification.recording.preparation import PreparedRun
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# SD of the phantom's position about the tip in each direction, [m].
_REACH_SD = 0.15
# Mass SD of an uninformative phantom, which regularises the regression of link errors on the payload, [kg].
_BROAD_MASS = 10.0
# Grid of the phantom's mass SD, even in the logarithm as its size is unknown, [kg].
_SMALLEST, _LARGEST, _NUM_SIZES = 1e-3, 1.0, 60
# Pull from outside, SD in each direction, [N]: 30 cm of a sensor's cable of 60 g a metre, an assumption.
PULL = 0.2


def build_phantom_covariance(mass_sd: float) -> Array:
    """Builds the covariance of the ten parameters of a mass of unknown sign near the tip, shape (10, 10)."""
    a = _REACH_SD**2
    C = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
    C[0, 0] = 1.0
    C[1:4, 1:4] = a * np.eye(3)
    # Moments of y^2 + z^2 and its permutations, with x, y and z normal.
    C[0, 4:7] = C[4:7, 0] = 2.0 * a
    C[4:7, 4:7] = a**2 * (6.0 * np.ones((3, 3)) + 2.0 * np.eye(3))
    C[7:, 7:] = a**2 * np.eye(3)
    return mass_sd**2 * C


def project_link_errors(robot: SerialChain, prepared: PreparedRun, samples: ChannelSamples, root: Array) -> Array:
    """Projects errors of the links onto the payload by least squares along a motion: its covariance, shape (10, 10).

    The links' parameters have the covariance L L^T with L the root, shape (10 n, 10 n).
    """
    W = robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot)
    seen_as = _project(samples, W) @ root
    covariance: Array = seen_as @ seen_as.T
    return covariance


def project_pulls(robot: SerialChain, prepared: PreparedRun, samples: ChannelSamples) -> Array:
    """Projects a pull from outside onto the payload by least squares along a motion: its covariance, (10, 10).

    A cable or a hose pulls in a direction that the motion does not change, at a link of the outer half of the arm;
    each of them is as probable, so that the pull has more than one lever.
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
    """Computes the payloads that torques, shape (N, C, K), look like by least squares, shape (10, K)."""
    Y = (samples.Y * samples.used[..., None]).reshape(-1, NUM_PARAMETERS)
    broad = np.linalg.inv(build_phantom_covariance(_BROAD_MASS))
    torques = (columns * samples.used[..., None]).reshape(len(Y), -1)
    seen_as: Array = np.linalg.solve(Y.T @ Y + broad, Y.T @ torques)
    return seen_as


def estimate_phantom_mass(stretches: list[Quadratic]) -> float:
    """Estimates the SD of the phantom's mass from the apparent payloads of empty stretches, [kg].

    Each stretch has the likelihood p(signals | delta) with delta ~ N(0, s^2 C). The root mean square of s under its
    posterior is returned, so that few stretches give a larger one.
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
    """Estimates the SD of the phantom's mass, [kg], and the share of friction that a fit leaves.

    A function builds the likelihoods of empty stretches for each share. Both sizes are root mean squares under their
    joint posterior, with priors that are even in the logarithms, so that few stretches give larger ones.
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
