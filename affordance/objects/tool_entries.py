"""Data models of tool files: keys, types and bounds."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
import scipy
from numpy.typing import ArrayLike
from pydantic import Field

from affordance.arrays import Array
from affordance.files.constraints import Length, Name, Vector, Whole, Within
from affordance.files.data_model import DataModel
from affordance.objects.tool import CAD_PLACE_SD, CAD_VOLUME_SD

# Bounds of lengths of hand-held objects, from a tenth of a millimetre to a metre, [m]. Values outside them are
# mistakes in units.
SIZE_MIN, SIZE_MAX = 1e-4, 1.0
# Bounds of the errors of a part's form. For larger errors of volume, a first-order model is not valid.
VOLUME_SD_MAX, PLACE_SD_MAX = 0.6, 0.1
# Bounds of weighed masses, from a milligram to ten tons, [kg]. A tool outside them also violates other bounds.
MASS_MIN, MASS_MAX = 1e-6, 1e4


type Mass = Annotated[float, Within(MASS_MIN, MASS_MAX)]
type Lengths = Annotated[tuple[float, float, float], Vector(3, Length(SIZE_MIN, SIZE_MAX))]
type RadiusAndLength = Annotated[tuple[float, float], Vector(2, Length(SIZE_MIN, SIZE_MAX))]
type Position = Annotated[tuple[float, float, float], Vector(3, Length(-SIZE_MAX, SIZE_MAX))]
type Rotations = Annotated[tuple[float, float, float], Vector(3, Within(-360.0, 360.0))]
type Direction = Annotated[tuple[float, float, float], Vector(3, Within(-1.0, 1.0))]


class PoseEntry(DataModel):
    """Position and orientation in the tool's frame T."""

    position: Annotated[Position, Field(description="Position in T, [m]; the origin of T by default.")] = (
        0.0,
        0.0,
        0.0,
    )
    rpy_deg: Annotated[Rotations | None, Field(description="Roll, pitch and yaw, [deg].")] = None

    def build_pose(self) -> Array:
        """Builds the pose, (4, 4)."""
        return build_pose(self.position, self.rpy_deg)


class ComponentEntry(DataModel):
    """Solid part of a tool, or several parts from a mesh, in a file.

    The reader of tools files checks combinations of keys.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"density": "a density belongs to a material, in materials.yaml"}

    semi_axes: Annotated[Lengths | None, Field(description="Semi-axes of an ellipsoid, [m].")] = None
    box: Annotated[Lengths | None, Field(description="Lengths of a box, [m].")] = None
    cylinder: Annotated[
        RadiusAndLength | None, Field(description="Radius and length of a cylinder along z, [m].")
    ] = None
    capsule: Annotated[
        RadiusAndLength | None,
        Field(description="Radius of a capsule along z, and length between the centres of its ends, [m]."),
    ] = None
    mesh: Annotated[Name | None, Field(description="File with closed surfaces: .obj, .ply or .stl.")] = None
    unit: Annotated[Name | None, Field(description="Unit of the mesh: m, cm, mm or in.")] = None
    shell: Annotated[
        Annotated[int, Whole(0)] | None, Field(description="Index of a shell in the mesh; all shells by default.")
    ] = None
    materials: Annotated[
        Annotated[list[Name], Field(min_length=1)] | None,
        Field(description="Material of each shell in the mesh, in the shells' order."),
    ] = None
    position: Annotated[Position | None, Field(description="Position in T, [m]; the origin of T by default.")] = None
    rpy_deg: Annotated[Rotations | None, Field(description="Roll, pitch and yaw, [deg].")] = None
    material: Annotated[Name | None, Field(description="Material of the part.")] = None
    colour: Annotated[
        Name | None,
        Field(description="Colour of the part, or 'file' for the mesh's colours; the material's colour by default."),
    ] = None
    looks_like: Annotated[
        Name | None, Field(description="Material whose colour is visible; the part's own material by default.")
    ] = None
    mass: Annotated[Mass | None, Field(description="Measured mass of the part, [kg].")] = None
    mass_sd: Annotated[
        Mass | None, Field(description="Standard deviation of the measured mass, [kg]; 1 % of it by default.")
    ] = None
    volume_sd: Annotated[
        float,
        Within(0.0, VOLUME_SD_MAX),
        Field(description="Relative standard deviation of the volume; by default as for a drawing."),
    ] = CAD_VOLUME_SD
    place_sd: Annotated[
        float,
        Length(0.0, PLACE_SD_MAX),
        Field(description="Standard deviation of each coordinate of the centroid, [m]; by default as for a drawing."),
    ] = CAD_PLACE_SD


class StrikeEntry(DataModel):
    """Striking face in a file."""

    point: Annotated[Position, Field(description="Middle of the face in T, [m].")]
    normal: Annotated[Direction, Field(description="Outward normal of the face in T, of any length.")]


class ToolEntry(DataModel):
    """Tool in a file."""

    name: Annotated[Name, Field(description="Name of the tool, unique in the file.")]
    components: Annotated[list[ComponentEntry], Field(min_length=1, description="Solid parts of the tool.")]
    grips: Annotated[
        Annotated[dict[Name, PoseEntry], Field(min_length=1)] | None,
        Field(description="Poses of the hand's frame, by the grip's name; Tx points out of the hand."),
    ] = None
    strikes: Annotated[
        Annotated[dict[Name, StrikeEntry], Field(min_length=1)] | None,
        Field(description="Faces that are designed to strike, by name."),
    ] = None
    mass: Annotated[Mass | None, Field(description="Measured mass of the whole tool, [kg].")] = None
    mass_sd: Annotated[
        Mass | None, Field(description="Standard deviation of the measured mass, [kg]; 1 % of it by default.")
    ] = None


def build_pose(position: ArrayLike, rpy_deg: tuple[float, float, float] | None = None) -> Array:
    """Builds a pose, (4, 4), from a position, (3,), [m], and optional roll, pitch and yaw, [deg]."""
    X = np.eye(4)
    X[:3, 3] = position
    if rpy_deg is not None:
        X[:3, :3] = scipy.spatial.transform.Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    return X
