"""Lines that set the payload of a robot, ready to be pasted.

The centre of mass is measured from the tip, axes are those of the tip, and moments are about the centre of mass.
Makers differ in order and unit, and all of them expect the tip to be their flange.
"""

import numpy as np

from affordance.arrays import Array
from affordance.identification.posterior.payload_belief import describe_bodies


def list_payload_settings(pi: Array) -> dict[str, str]:
    """Writes payload settings, by robot, from ten parameters at the flange, shape (10,)."""
    m, *c = (float(value) for value in describe_bodies(pi[None])[0][:4])
    xx, yy, zz, xy, xz, yz = (float(value) for value in describe_bodies(pi[None])[0][4:])
    # Elements of the inertia matrix; with Ixy = -integral(x y dm) the matrix holds them as they are.
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    column_major = ", ".join(f"{value:.6g}" for value in matrix.T.ravel())
    centre = ", ".join(f"{value:.5f}" for value in c)
    x, y, z = c
    return {
        "Universal Robots (URScript)": (
            f"set_target_payload({m:.4f}, [{centre}], [{xx:.6g}, {yy:.6g}, {zz:.6g}, {xy:.6g}, {xz:.6g}, {yz:.6g}])"
        ),
        "Franka (libfranka)": f"robot.setLoad({m:.4f}, {{{{{centre}}}}}, {{{{{column_major}}}}});",
        "URDF": (
            f'<inertial><mass value="{m:.4f}"/><origin xyz="{x:.5f} {y:.5f} {z:.5f}"/>'
            f'<inertia ixx="{xx:.6g}" iyy="{yy:.6g}" izz="{zz:.6g}" ixy="{xy:.6g}" ixz="{xz:.6g}" iyz="{yz:.6g}"/>'
            "</inertial>"
        ),
        "Drake (Python)": (
            f"SpatialInertia.MakeFromCentralInertia({m:.6g}, [{centre}], RotationalInertia("
            f"{xx:.6g}, {yy:.6g}, {zz:.6g}, {xy:.6g}, {xz:.6g}, {yz:.6g}))"
        ),
    }
