"""Comparison of inertia from meshes with that from the program that drew the tools."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.experiments.tools.data_set import DataSet, TrueInertia
from affordance.objects.inertia import parameters_from_pseudo_inertia
from affordance.objects.tool import Tool


class Deviation(NamedTuple):
    """Error of a tool's inertia from its mesh.

    Attributes:
        mass: Error of the mass, as a fraction of the true one.
        com: Largest error of a coordinate of the centre of mass, [m].
        inertia: Norm of the error of the rotational inertia, as a fraction of that of the true one.
    """

    mass: float
    com: float
    inertia: float


def measure_parity(data: DataSet) -> dict[str, Deviation]:
    """Compares all tools with their true inertia, by name."""
    return {name: compare_inertia(tool, data.read_truth(name)) for name, tool in data.tools.items()}


def compare_inertia(tool: Tool, truth: TrueInertia) -> Deviation:
    """Compares a tool, as it is written in the frame of its mesh, with its true inertia."""
    I_BBcm = compute_central_inertia(tool.parameters)
    return Deviation(
        abs(tool.mass / truth.mass - 1.0),
        float(np.abs(tool.p_TTcm - truth.p_FBcm).max()),
        float(np.linalg.norm(I_BBcm - truth.I_BBcm_F) / np.linalg.norm(truth.I_BBcm_F)),
    )


def compute_central_inertia(pi: Array) -> Array:
    """Computes the rotational inertia about the centre of mass, (3, 3), [kg m^2], from inertial parameters, (10,)."""
    mass, com = pi[0], pi[1:4] / pi[0]
    J = np.zeros((4, 4))
    J[:3, :3], J[:3, 3], J[3, :3], J[3, 3] = np.outer(com, com) * mass, mass * com, mass * com, mass
    xx, yy, zz, xy, xz, yz = (pi - parameters_from_pseudo_inertia(J))[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
