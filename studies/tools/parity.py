"""Inertia from meshes beside what the program that drew the tools says."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import parameters_from_pseudo_inertia
from affordance.objects.tool import Tool
from studies.tools.data_set import DataSet, TrueInertia


class Deviation(NamedTuple):
    """How far a tool's inertia from its mesh is off.

    Attributes:
        mass: As a fraction of the true mass.
        com: Largest coordinate of the centre of mass's error, [m].
        inertia: Norm of the error of the rotational inertia, as a fraction of that of the true one.
    """

    mass: float
    com: float
    inertia: float


def measure_parity(data: DataSet) -> dict[str, Deviation]:
    """Compares all tools, by name."""
    return {name: compare_inertia(tool, data.read_truth(name)) for name, tool in data.tools.items()}


def compare_inertia(tool: Tool, truth: TrueInertia) -> Deviation:
    """Compares a tool, as it is written in the frame of its mesh, with what it is said to weigh."""
    I_BBcm = compute_central_inertia(tool.parameters)
    return Deviation(
        abs(tool.mass / truth.mass - 1.0),
        float(np.abs(tool.p_TTcm - truth.p_FBcm).max()),
        float(np.linalg.norm(I_BBcm - truth.I_BBcm_F) / np.linalg.norm(truth.I_BBcm_F)),
    )


def compute_central_inertia(pi: Array) -> Array:
    """Rotational inertia about the centre of mass by ten inertial parameters, (10,); shape (3, 3), [kg m^2]."""
    mass, com = pi[0], pi[1:4] / pi[0]
    J = np.zeros((4, 4))
    J[:3, :3], J[:3, 3], J[3, :3], J[3, 3] = np.outer(com, com) * mass, mass * com, mass * com, mass
    xx, yy, zz, xy, xz, yz = (pi - parameters_from_pseudo_inertia(J))[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
