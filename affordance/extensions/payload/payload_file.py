"""Writes an identified payload as URDF, SDF, MJCF or JSON.

Numbers are written with all digits. The frame of the link is the tip frame of the identification. This module does
not import Drake.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.exceptions import BadValueError, show_text
from affordance.files.atomic import write_text

SUFFIXES = (".urdf", ".sdf", ".xml", ".json")
_MOST_DRAWS = 10_000
# Density of a ball that replaces moments that were not measured, [kg/m^3], typical of household objects, and SD of
# its logarithm. Both are assumptions and are named in the files.
_DENSITY, _DENSITY_SPREAD = 1000.0, 0.7
_LEAST = 1e-9  # smallest principal moment relative to the largest that simulators accept


class Body(NamedTuple):
    """Rigid body in a frame T."""

    mass: float  # [kg]
    centre: Array  # p_TTcm, shape (3,), [m]
    inertia: Array  # rotational inertia about Tcm, in T, shape (3, 3), [kg m^2]

    @classmethod
    def from_parameters(cls, pi: Array) -> "Body":
        """Builds a body from its ten inertial parameters about To.

        Moments that rounding has made physically impossible are replaced with the nearest possible moments.
        """
        mass, centre = float(pi[0]), pi[1:4] / pi[0]
        inertia = build_symmetric(pi[4:]) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        # With Sigma = trace(I) / 2 - I, the body is possible if Sigma has no negative eigenvalue.
        values, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
        values = np.maximum(values, _LEAST * max(values.max(), np.finfo(float).tiny))
        return cls(mass, centre, (axes * (values.sum() - values)) @ axes.T)


def spread_moments(parameters: Array, rng: np.random.Generator) -> Array:
    """Adds the moments of a ball to samples of mass and first moment, (S, 4).

    The ball has about the density of water.

    Returns: Ten inertial parameters of each sample, shape (S, 10).
    """
    mass, moment = parameters[:, 0], parameters[:, 1:4]
    density = _DENSITY * np.exp(_DENSITY_SPREAD * rng.standard_normal(len(mass)))
    of_ball = 0.4 * mass * (3.0 * mass / (4.0 * np.pi * density)) ** (2.0 / 3.0)
    c = moment / mass[:, None]
    products = mass[:, None, None] * (np.sum(c**2, axis=1)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None])
    tensors = products + of_ball[:, None, None] * np.eye(3)
    i, j = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    return np.column_stack([parameters, tensors[:, i, j]])


def check_target(path: Path | None, draws: int) -> None:
    """Checks the options ``--write`` and ``--draws``.

    Raises:
        BadValueError: No format has the file's suffix, or the number of draws is out of bounds.
    """
    if path is None and draws:
        raise BadValueError("--draws", "", f"is {draws}, must be given with --write FILE")
    if path is not None and path.suffix.lower() not in SUFFIXES:
        raise BadValueError("--write", "", f"is {path.name!r}, must end with {', '.join(SUFFIXES)}")
    if not 0 <= draws <= _MOST_DRAWS:
        raise BadValueError("--draws", "", f"is {draws}, must be from 0 to {_MOST_DRAWS}")


def write_payload(
    path: Path,
    bodies: Array,
    frame: str,
    *,
    weights: Array | None = None,
    note: str = "",
    draws: int = 0,
    seed: int = 0,
) -> list[str]:
    """Writes the posterior mean of a payload, and random draws from its posterior, for simulators.

    Args:
        path: File, with one of the suffixes ``SUFFIXES``.
        bodies: Samples of the ten inertial parameters about To, in T, shape (S, 10).
        frame: Name of T.
        weights: Weights of the samples, shape (S,); None for equal weights.
        note: Comment on the numbers that is written to the file.
        draws: Number of random draws; each is written to its own file, with its number before the suffix.
        seed: Seed of the draws.

    Returns: Names of the files.
    """
    weights = np.full(len(bodies), 1.0 / len(bodies)) if weights is None else weights / weights.sum()
    chosen = np.random.default_rng(seed).choice(len(bodies), draws, p=weights)
    width, files = len(str(draws)), []
    for number, pi in enumerate([weights @ bodies, *bodies[chosen]]):
        name = path.name if not number else f"{path.stem}_{number:0{width}}{path.suffix}"
        said = f"payload in the frame {frame}{f'; {note}' if note else ''}{'; a draw' if number else ''}"
        write_text(path.with_name(name), format_body(Body.from_parameters(pi), path.suffix.lower(), frame, said))
        files.append(name)
    return files


def describe_written(path: Path, files: Sequence[str]) -> str:
    """Describes the files that ``write_payload`` wrote, or the reason why none were written."""
    if not files:
        return f"{path} is not written, as the answer is not to be trusted"
    return f"{path}: the payload as a link{f'; {len(files) - 1} draws to {files[-1]}' if files[1:] else ''}"


def format_body(body: Body, suffix: str, frame: str, note: str) -> str:
    """Formats a body in the file format of a suffix.

    Args:
        body: Body in a frame T.
        suffix: One of ``SUFFIXES``.
        frame: Name of T.
        note: Comment of one line.
    """
    m, (x, y, z) = repr(body.mass), (repr(float(each)) for each in body.centre)
    entries = list_entries(body.inertia)
    if suffix == ".json":
        content = {"frame": frame, "mass": body.mass, "com": body.centre.tolist(), "inertia": entries}
        return json.dumps(content, indent=2) + "\n"
    xx, yy, zz, xy, xz, yz = (repr(each) for each in entries)
    # Comments in XML must not contain "--", but names from foreign files may.
    comment = f"<!-- {show_text(note).replace('--', '- - ')} -->"
    if suffix == ".xml":
        return (
            f'<mujoco model="payload">\n  {comment}\n  <compiler balanceinertia="false"/>\n  <worldbody>\n'
            f'    <body name="payload">\n      <freejoint/>\n      <inertial pos="{x} {y} {z}" mass="{m}"'
            f' fullinertia="{xx} {yy} {zz} {xy} {xz} {yz}"/>\n    </body>\n  </worldbody>\n</mujoco>\n'
        )
    if suffix == ".sdf":
        names = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (xx, yy, zz, xy, xz, yz), strict=True)
        inertia = "".join(f"<{name}>{value}</{name}>" for name, value in names)
        return (
            f'<?xml version="1.0"?>\n{comment}\n<sdf version="1.7">\n  <model name="payload">\n'
            f'    <link name="payload">\n      <inertial>\n        <pose>{x} {y} {z} 0 0 0</pose>\n'
            f"        <mass>{m}</mass>\n        <inertia>{inertia}</inertia>\n"
            "      </inertial>\n    </link>\n  </model>\n</sdf>\n"
        )
    return (
        f'<?xml version="1.0"?>\n{comment}\n<robot name="payload">\n'
        '  <mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco>\n  <link name="payload_mount"/>\n'
        '  <joint name="payload_joint" type="fixed"><parent link="payload_mount"/><child link="payload"/></joint>\n'
        f'  <link name="payload">\n    <inertial>\n      <origin xyz="{x} {y} {z}" rpy="0 0 0"/>\n'
        f'      <mass value="{m}"/>\n      <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}"'
        f' iyz="{yz}"/>\n    </inertial>\n  </link>\n</robot>\n'
    )
