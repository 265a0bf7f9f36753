"""Paths in space with minimum-jerk timing, and their YAML files (models/paths/)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from pydrake.trajectories import PathParameterizedTrajectory, PiecewisePolynomial, Trajectory

from affordance.arguments import check_array
from affordance.control.task import Start, StartEntry
from affordance.exceptions import BadArgumentError
from affordance.files.constraints import StrPath, Vector, Within, check_fields, check_path, complain
from affordance.files.data_model import DataModel, load_model

# Bounds of paths: points within two metres, durations from 0.05 s to a minute.
_REACH_MAX = 2.0
_DURATION = Within(0.05, 60.0)
_TOLERANCE = Within(1e-4, _REACH_MAX)
# Smallest distance between successive points of a path, [m].
_SEPARATION_MIN = 1e-3
# Factors on duration and lengths of easier paths.
EASIER_PACES, EASIER_SIZES = (1.0, 2.0), (1.0, 0.75, 0.5, 0.25)
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class TimedPath:
    """Smooth path through points from rest to rest with minimum-jerk timing.

    Attributes:
        points: At least one point after the start, relative to the start, in W, [m].
        start: Start angles, [rad], of joints that do not start at their home angles.
        duration: Time from start to end, [s].
        tolerance: Largest allowed distance from the path, [m].
    """

    points: tuple[tuple[float, float, float], ...]
    duration: Annotated[float, _DURATION]
    tolerance: Annotated[float, _TOLERANCE]
    start: Start = ()

    def __post_init__(self) -> None:
        """Checks all values.

        Raises:
            BadArgumentError: A number is not finite or out of bounds, or there is no point.
        """
        points = check_array("points", self.points, (None, 3))
        if not len(points):
            raise BadArgumentError("points", "", "is empty, must hold at least one point")
        object.__setattr__(self, "points", tuple((float(x), float(y), float(z)) for x, y, z in points))
        check_fields(self)

    def describe_error(self, error: float) -> str:
        """Describes a distance from the path, [m], that exceeds the tolerance; otherwise empty."""
        if error <= self.tolerance:
            return ""
        return f"leaves the path by {error:.3g} m, must stay within {self.tolerance:g} m"

    def name_nearest_point(self, time: float) -> str:
        """Describes which point is nearest to the path's position at a time, [s]."""
        place = self.build_trajectory().value(min(max(time, 0.0), self.duration))[:, 0]
        nearest = int(np.argmin(np.linalg.norm(np.array([(0.0, 0.0, 0.0), *self.points]) - place, axis=1)))
        if nearest == 0:
            return "the start"
        where = ", ".join(f"{value:g}" for value in self.points[nearest - 1])
        return f"point {nearest} of {len(self.points)} at [{where}]"

    def list_easier(self, paces: Sequence[float], sizes: Sequence[float]) -> "Iterator[tuple[TimedPath, str]]":
        """Yields the path, with an empty description, and easier variants with descriptions.

        Variants are mirrored first, then slower, then smaller. Durations that are out of bounds are omitted.

        Args:
            paces: Factors on the duration, starting with 1.
            sizes: Factors on the lengths, starting with 1.
        """
        points = np.array(self.points)
        paces = [pace for pace in paces if self.duration * pace <= _DURATION.high]
        for size in sizes:
            for pace in (each for each in paces if self.duration * each <= _DURATION.high):
                for mirrored in (False, True):
                    placed = size * points * (_MIRROR if mirrored else 1.0)
                    words = [f"{size:g} times as large"] if size != 1.0 else []
                    words += ["mirrored"] if mirrored else []
                    words += [f"{pace:g} times slower"] if pace != 1.0 else []
                    rows = tuple((float(f"{x:.6g}"), float(f"{y:.6g}"), float(f"{z:.6g}")) for x, y, z in placed)
                    yield replace(self, points=rows, duration=self.duration * pace), ", ".join(words)

    def build_trajectory(self) -> Trajectory:
        """Builds the trajectory of positions relative to the start, (3, 1), [m], from rest to rest.

        The curve is a cubic spline over the chord length, or a line if there is only one point. The timing is
        s(t) = 10 u^3 - 15 u^4 + 6 u^5 with u = t / duration (Flash & Hogan 1985, eq. 3).
        """
        points = np.array([(0.0, 0.0, 0.0), *self.points])
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        spline = PiecewisePolynomial.CubicWithContinuousSecondDerivatives
        interpolate = spline if len(points) > 2 else PiecewisePolynomial.FirstOrderHold
        curve = interpolate(lengths.tolist(), points.T.tolist())
        u = np.linspace(0.0, 1.0, 6)  # six points determine a polynomial of degree five
        timing = lengths[-1] * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        return PathParameterizedTrajectory(
            curve,
            PiecewisePolynomial.LagrangeInterpolatingPolynomial((self.duration * u).tolist(), [timing.tolist()]),
        )


class PathEntry(DataModel):
    """Entry of a path in a file."""

    duration: Annotated[float, _DURATION, Field(description="Time from rest to rest, [s].")]
    tolerance: Annotated[
        float, _TOLERANCE, Field(description="Largest distance at which the tip still counts as on the path, [m].")
    ]
    points: Annotated[
        list[Annotated[tuple[float, float, float], Vector(3, Within(-_REACH_MAX, _REACH_MAX))]],
        Field(min_length=1, description="Points after the start, relative to it: forward, left, up, [m]."),
    ]
    start: StartEntry = Field(default_factory=dict)

    @model_validator(mode="after")
    def check_steps(self) -> Self:
        """Checks that successive points do not coincide."""
        steps = np.linalg.norm(np.diff(np.array(self.points), axis=0, prepend=0.0), axis=1)
        if (steps < _SEPARATION_MIN).any():
            problem = f"is {steps.min():g} m from the previous point, must be at least {_SEPARATION_MIN:g} m"
            raise complain(problem, f"points[{np.argmin(steps)}]")
        return self

    def build(self) -> TimedPath:
        """Builds the path."""
        return TimedPath(tuple(self.points), self.duration, self.tolerance, tuple(self.start.items()))


def load_path(path: StrPath) -> TimedPath:
    """Loads a path from a file with the keys ``duration``, ``tolerance``, ``points`` and ``start``.

    Raises:
        BadValueError: The file or one of its values is invalid. The message contains file, key and reason.
    """
    return load_model(check_path("path", path), PathEntry).build()
