"""Reads the workshop tools of Nadeau, Giamou and Kelly (ICRA 2023) from a user's clone, in two halves.

None of these data come with this program. The materials of the bodies in each mesh, and how each tool is held, are in
models/workshop/hps.yaml; densities of materials are in models/materials.yaml.
"""

import enum
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.constraints import Vector, Within
from affordance.files.data_model import DataModel, load_model
from affordance.objects.inertia import parameters_from_pseudo_inertia
from affordance.objects.load import load_tools, select_known
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool

# Learning half, on which every choice was made; the other ten tools were used once, at the end.
LEARNING = (
    "Allen Key",
    "Box Wrench",
    "C Clamp",
    "Clamp",
    "File",
    "Measuring Tape",
    "Nut Screwdriver",
    "Pliers",
    "Rubber Mallet",
    "Vise Grip",
)
_MESHES = Path("data", "Workshop Tools Dataset")
_SIMULATIONS = Path("data", "Simulations")
_SEGMENTATIONS = Path("data", "Segmentations")
_RESULTS = Path("inertial-parameters-identification", "Experiments", "results.pkl")
_LENGTH_MAX, _MASS_MAX = 1.0, 20.0
type _Triple = tuple[float, float, float]


class Half(enum.Enum):
    """Half of the tools."""

    LEARNING = "learning"
    TEST = "test"


@dataclass(frozen=True)
class TrueInertia:
    """True inertia of a tool, from the CAD program in which it was drawn."""

    mass: float  # mass, [kg]
    p_FBcm: Array  # centre of mass in the frame F of the mesh, shape (3,), [m]
    I_BBcm_F: Array  # rotational inertia about the centre of mass, shape (3, 3), [kg m^2]


class _InertiaEntry(DataModel):
    """Entries that are used of a tool's inertia in the data set."""

    model_config = ConfigDict(extra="ignore")

    MASS: Annotated[float, Within(1e-6, _MASS_MAX)]
    COM_WRT_MESH: Annotated[_Triple, Vector(3, Within(-_LENGTH_MAX, _LENGTH_MAX))]
    INERTIA_WRT_COM: Annotated[list[Annotated[_Triple, Vector(3, Within())]], Field(min_length=3, max_length=3)]


class _InertiaFile(DataModel):
    """Inertia.yaml of a tool."""

    model_config = ConfigDict(extra="ignore")

    OBJECT: _InertiaEntry


def load_known_materials(models: Path) -> dict[str, Material]:
    """Loads the materials, by name, that an observer familiar with workshop tools recognises by sight.

    Raises:
        BadValueError: A file is invalid; the message names file and reason.
    """
    return select_known(load_materials(models / MATERIALS.name), (), models)


@dataclass(frozen=True)
class DataSet:
    """User's clone of the data set."""

    folder: Path  # folder of the clone
    models: Path  # folder of our models
    halves: tuple[Half, ...] = tuple(Half)  # halves whose files may be read

    @cached_property
    def materials(self) -> dict[str, Material]:
        """Materials of the tools, by name."""
        return load_known_materials(self.models)

    @cached_property
    def tools(self) -> dict[str, Tool]:
        """Tools of the halves by name, in the order of our file; files of other tools are not opened.

        Raises:
            BadValueError: A mesh is missing or cannot be read.
        """
        self.check()
        found = load_tools(
            self.models / "workshop" / "hps.yaml", self.materials, self.folder / _MESHES, chosen=self._is_open
        )
        return {tool.name: tool for tool in found}

    def check(self) -> None:
        """Checks that no file is missing, before anything runs for minutes.

        Raises:
            BadValueError: The folder is not a clone of the data set.
        """
        for path in (_MESHES, _SIMULATIONS, _SEGMENTATIONS):
            if not (self.folder / path).is_dir():
                problem = f"has no folder {str(path)!r}, must be a clone of the data set"
                raise BadValueError("--data", str(self.folder), problem)

    def _is_open(self, name: str) -> bool:
        return (Half.LEARNING if name in LEARNING else Half.TEST) in self.halves

    def list_names(self, half: Half) -> tuple[str, ...]:
        """Lists the names of the tools in a half."""
        return tuple(name for name in self.tools if (name in LEARNING) == (half is Half.LEARNING))

    def read_truth(self, name: str) -> TrueInertia:
        """Reads the true inertia of a tool.

        Raises:
            BadValueError: The file is missing or has an invalid value.
        """
        entry = load_model(self.folder / _MESHES / name / "Inertia.yaml", _InertiaFile).OBJECT
        return TrueInertia(entry.MASS, np.array(entry.COM_WRT_MESH), np.array(entry.INERTIA_WRT_COM))

    def find_mesh(self, name: str) -> Path:
        """Returns the path of the mesh of a tool."""
        return self.folder / _MESHES / name / "mesh.ply"

    def find_simulation(self, name: str) -> Path:
        """Returns the path of a tool's record of forces and torques."""
        return self.folder / _SIMULATIONS / f"{name.replace(' ', '_')}.pkl"

    def find_segmentation(self, name: str) -> Path:
        """Returns the path of a tool's parts as segmented by the data set's authors."""
        key = name.replace(" ", "_")
        return self.folder / _SEGMENTATIONS / key / f"{key}.ply"

    @property
    def stored_results(self) -> Path:
        """Path of the errors stored by the data set's authors."""
        return self.folder / _RESULTS


class Deviation(NamedTuple):
    """Error of a tool's inertia as computed from its mesh."""

    mass: float  # error of the mass, as a fraction of the true mass
    com: float  # largest error of a coordinate of the centre of mass, [m]
    inertia: float  # norm of the error of the rotational inertia, as a fraction of the true norm


def measure_parity(data: DataSet) -> dict[str, Deviation]:
    """Compares the inertia of all tools with the truth; returns errors by name of the tool."""
    return {name: compare_inertia(tool, data.read_truth(name)) for name, tool in data.tools.items()}


def compare_inertia(tool: Tool, truth: TrueInertia) -> Deviation:
    """Compares a tool's inertia, in the frame of its mesh, with the true inertia."""
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
