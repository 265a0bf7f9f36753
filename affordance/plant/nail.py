"""Nail of Simulation IV: its body in the plant, and the resistance of the wood.

The nail slides along its axis in a fixed block. Its resistance is a separate system, because Drake's joints have
damping but no dry friction. Frames: W the world, N at the top of the head, with Nz along the driving direction.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Joint, PrismaticJoint, SpatialInertia
from pydrake.systems.framework import BasicVector, Context

from affordance.arrays import Array
from affordance.drake.sampled_system import SampledSystem
from affordance.files.constraints import Within
from affordance.files.data_model import DataModel
from affordance.plant.contact import CONTACT_STIFFNESS, ContactFace, register_surface

# Withdrawal load of a nail from the side grain of wood, per depth and diameter: 54.12 G^(5/2) N/mm^2 with G the
# wood's specific gravity (Wood Handbook FPL-GTR-190, chapter 8). The same skin friction resists the nail's entry.
_WITHDRAWAL = 54.12e6
# Slip speed above which friction has its full value, [m/s]; below it, friction is smoothed. During the 5 ms of a blow
# the tool therefore slides on the nail by up to 50 um. With Drake's default of 1e-3, the integrator's Newton
# iteration fails at the transition from slip to stick: a blow takes up to three times as long to simulate (6000 steps
# instead of 500 were observed), and the peak force differs by only 0.3 %.
STICTION_TOLERANCE = 1e-2
# Contact force above which a nail counts as touched, [N].
_TOUCH = 1.0
# Fraction of its travel after which a nail counts as at rest.
_ALMOST = 0.999
# Speed below which the nail counts as at rest, [m/s]. Dry friction jumps at zero speed, which integrators for smooth
# systems cannot handle, so a tanh of this width replaces the jump. As a result, a nail at rest slides under its own
# weight by 0.3 um per second.
_REST = 1e-3
_BLOCK = 0.1  # edge of the block that is drawn, [m]


@dataclass(frozen=True)
class Nail:
    """Nail in wood, with its depth before the blow and the required depth after it."""

    diameter: float  # diameter of the shank, [m]
    length: float  # length of the shank, [m]
    density: float  # density of the nail, [kg/m^3]
    head_radius: float  # radius of the round head, [m]
    wood_specific_gravity: float  # specific gravity of the wood, dimensionless
    depth_set: float  # depth of the nail before the blow, [m]
    depth_demanded: float  # required depth of the nail after the blow, [m]
    # Depth-independent resistance, [N]; None for skin friction, which grows with depth.
    yield_force: float | None = None

    @property
    def mass(self) -> float:
        """Mass of shank and head, [kg]."""
        shank = np.pi / 4.0 * self.diameter**2 * self.length
        return float(self.density * (shank + 4.0 / 3.0 * np.pi * self.head_radius**3))

    @property
    def stiffness(self) -> float:
        """Increase of the resistance per depth, k_n, [N/m]."""
        return float(_WITHDRAWAL * self.wood_specific_gravity**2.5 * self.diameter)

    @property
    def force_demanded(self) -> float:
        """Resistance at the required depth, [N]."""
        return float(self.stiffness * self.depth_demanded)

    def compute_resistance(self, depth: float) -> float:
        """Computes the wood's resistance to a moving nail, [N].

        Args:
            depth: Depth of the nail, [m]; at zero or less the nail is out, and the resistance is zero.
        """
        if self.yield_force is not None:
            return self.yield_force if depth > 0.0 else 0.0
        return self.stiffness * max(0.0, depth)

    def compute_tip_speed(self, force: Array, effective_mass: Array) -> Array:
        """Computes the tip speed at impact that produces a given peak friction force, [m/s].

        The kinetic energy at the tip equals the work of friction between the two depths plus the energy stored in the
        contact: m v^2 = (F^2 - F_set^2) / k_n + F^2 / k_c. The nail's few grams are neglected. The speed is zero for
        a force below the resistance at the initial depth.

        Args:
            force: Peak friction forces, [N].
            effective_mass: Effective masses along the nail, [kg]; broadcast against the forces.
        """
        lost = np.maximum(0.0, np.square(force) - (self.stiffness * self.depth_set) ** 2) / self.stiffness
        stored = np.where(lost > 0.0, np.square(force) / CONTACT_STIFFNESS, 0.0)
        speed: Array = np.sqrt((lost + stored) / effective_mass)
        return speed


class NailRecord(NamedTuple):
    """Motion and forces of a nail, recorded at N steps of the integrator."""

    times: Array  # (N,), [s]
    travel: Array  # distance driven since the nail was set, (N,), [m]
    rate: Array  # rate of the travel, (N,), [m/s]
    resistance: Array  # resistance of the wood against being driven in, (N,), [N]
    contact: Array  # force of the tool on the head along the driving direction, (N,), [N]

    @property
    def time_of_touch(self) -> float:
        """Time of the tool's first contact with the nail, [s]; the first recorded time if there is no contact."""
        return float(self.times[np.argmax(self.contact > _TOUCH)])

    @property
    def time_of_rest(self) -> float:
        """Time at which the nail has almost reached its final depth, [s]."""
        return float(self.times[np.argmax(self.travel >= _ALMOST * self.travel[-1])])


class NailPlacement(NamedTuple):
    """Nail with its position and driving direction."""

    nail: Nail
    p_WNo: Array  # position of the highest point of the head, shape (3,), [m]
    direction_W: Array  # direction in which the nail is driven, a unit vector, shape (3,)
    face: ContactFace | None = None  # surface that strikes the nail, if any

    @property
    def key(self) -> tuple[object, ...]:
        """Hashable key that contains all values of the placement."""
        face = () if self.face is None else (self.face.p_TS.tobytes(), self.face.normal_T.tobytes(), self.face.radius)
        return (self.nail, self.p_WNo.tobytes(), self.direction_W.tobytes(), *face)


class NailEntry(DataModel):
    """Nail in a file."""

    diameter: Annotated[float, Within(5e-4, 0.02), Field(description="Diameter of the shank, [m].")]
    length: Annotated[float, Within(5e-3, 0.3), Field(description="Length of the nail, [m].")]
    density: Annotated[float, Within(500.0, 25_000.0), Field(description="Density, [kg/m^3].")]
    head_radius: Annotated[float, Within(5e-4, 0.05), Field(description="Radius of the nail's round head, [m].")]
    wood_specific_gravity: Annotated[float, Within(0.1, 1.3), Field(description="Specific gravity of the wood.")]
    depth_set: Annotated[float, Within(1e-4, 0.3), Field(description="Depth of the nail before the blow, [m].")]
    depth_demanded: Annotated[
        float, Within(1e-4, 0.3), Field(description="Required depth of the nail after the blow, [m].")
    ]

    @model_validator(mode="after")
    def check_depths(self) -> Self:
        """Rejects a depth greater than the nail's length, and a required depth less than the initial depth."""
        Within(1e-4, self.length).check(self.depth_set, "depth_set")
        Within(self.depth_set, self.length).check(self.depth_demanded, "depth_demanded")
        return self

    def build(self) -> Nail:
        """Builds the nail from its entry."""
        return Nail(**{name: getattr(self, name) for name in NailEntry.model_fields})


def add_nail(plant: MultibodyPlant, placement: NailPlacement, name: str = "nail") -> Joint:
    """Adds a nail to a plant that is not yet finalized. Body, joint and model instance have the same name.

    The position of the joint is the nail's travel, which is zero at the initial depth.
    """
    nail = placement.nail
    # Frame N: at the top of the head, Nz along the driving direction.
    X_WN = RigidTransform(RotationMatrix.MakeFromOneVector(placement.direction_W, 2), placement.p_WNo)
    start = plant.AddFrame(FixedOffsetFrame(f"{name}_start", plant.world_frame(), X_WN))
    inertia = SpatialInertia.SolidCylinderWithMass(
        nail.mass, 0.5 * nail.diameter, nail.length, np.array([0.0, 0.0, 1.0])
    ).Shift(np.array([0.0, 0.0, -0.5 * nail.length]))
    body = plant.AddRigidBody(name, plant.AddModelInstance(name), inertia)
    joint = plant.AddJoint(PrismaticJoint(name, start, body.body_frame(), np.array([0.0, 0.0, 1.0])))
    if plant.geometry_source_is_registered():
        head = RigidTransform(np.array([0.0, 0.0, nail.head_radius]))
        register_surface(plant, body, head, Sphere(nail.head_radius), "head")
        grey, wood = np.array([0.45, 0.47, 0.5, 1.0]), np.array([0.85, 0.72, 0.53, 1.0])
        plant.RegisterVisualGeometry(body, head, Sphere(nail.head_radius), "head_visual", grey)
        shank = RigidTransform(np.array([0.0, 0.0, 0.5 * nail.length]))
        plant.RegisterVisualGeometry(body, shank, Cylinder(0.5 * nail.diameter, nail.length), "shank", grey)
        surface = nail.length - nail.depth_set
        block = X_WN @ RigidTransform(np.array([0.0, 0.0, surface + 0.5 * _BLOCK]))
        plant.RegisterVisualGeometry(plant.world_body(), block, Box(_BLOCK, _BLOCK, _BLOCK), f"{name}_block", wood)
    return joint


class NailResistance(SampledSystem):
    """Dry friction of the wood on the nail, which depends on the nail's depth and causes no rebound.

    Input ports:
        state: Travel of the nail, and its rate, (2,), [m, m/s].

    Output ports:
        force: Generalized forces, (num_velocities,), [N, N m]; zero except for the nail's joint.
        resistance: Resistance to being driven in, (1,), [N].
    """

    def __init__(self, nail: Nail, *, num_velocities: int, index: int) -> None:
        super().__init__()
        self._nail = nail
        self._index = index
        self.declare_vector_input("state", 2)
        self.DeclareVectorOutputPort("force", BasicVector(np.zeros(num_velocities)), self._calc_force)
        self.DeclareVectorOutputPort("resistance", 1, self._calc_resistance)

    def _compute_resistance(self, context: Context) -> float:
        state = self.EvalVectorInput(context, 0)  # without an array, at a third of the time
        travel, rate = state[0], state[1]
        return self._nail.compute_resistance(self._nail.depth_set + travel) * math.tanh(rate / _REST)

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        output.SetAtIndex(self._index, -self._compute_resistance(context))  # the others stay zero

    def _calc_resistance(self, context: Context, output: BasicVector) -> None:
        output.SetAtIndex(0, self._compute_resistance(context))
