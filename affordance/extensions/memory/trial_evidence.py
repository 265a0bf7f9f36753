"""Evidence of one trial, and its record in JSON.

The evidence consists of visual features and measured torques. It contains no beliefs.

Parts of the object are in the object frame T. The ten inertial parameters are about the origin of T.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from affordance.arguments import check_array, check_colour, check_kind, check_number, check_symmetry, check_whole
from affordance.arrays import Array
from affordance.belief.holds import Felt
from affordance.belief.likelihood import Quadratic
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice, show_value
from affordance.files.constraints import OneLine, Whole, run_check
from affordance.files.data_model import DataModel, check_content
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.version import __version__

# Largest negative eigenvalue of a precision matrix due to rounding, as a fraction of its largest eigenvalue.
_ROUNDING = 1e-9
_COUNTS = Whole(1, 1_000_000_000)
_JOINTS = Whole(0, 1000)
_MOST_PARTS = 1000
# Bounds of lengths in records, [m]. Other values are probably in the wrong unit.
_SIZES = 1e-4, 10.0
# Smallest volume of a part, [m^3], and largest volume and volume moments, [m^3, m^4, m^5].
_VOLUME_MIN, _MOMENT_MAX = 1e-15, 1e7
# Largest standard deviation of a visual feature, in any unit, and largest magnitude of the log evidence.
_SD_MAX, _LOG_MAX = 1e3, 1e12
# Strings in a record. The name of a robot combines a file name and a link name, of up to 255 and 200 characters.
_NAME, _LONG_NAME = OneLine(), OneLine(500)
_FIRST_YEAR = 1970


class FeltModel(Protocol):
    """Measurement model, which converts the features of a trial to evidence about densities."""

    def num_features(self, num_joints: int) -> int:
        """Returns the length of the feature vector."""

    def describe(self, features: Array, num_samples: int, num_joints: int, geometry: Geometry) -> Felt:
        """Converts the features to evidence about M densities; see ``NoiseModel``."""


@dataclass(frozen=True)
class PayloadQuadratic:
    """Quadratic log likelihood of the ten inertial parameters of an identified payload.

    The features are the precision matrix H, row by row, followed by the information vector b.
    """

    def num_features(self, num_joints: int) -> int:
        """Returns the number of entries of H and b."""
        return NUM_PARAMETERS * (NUM_PARAMETERS + 1)

    def describe(self, features: Array, num_samples: int, num_joints: int, geometry: Geometry) -> Felt:
        """Converts the features to evidence. The maximum of the log likelihood is set to zero."""
        of_body = unpack(features).restrict(np.eye(NUM_PARAMETERS))
        return Felt.from_quadratic(of_body, geometry.Phi, geometry.Phi_errors)


def pack(quadratic: Quadratic) -> Array:
    """Converts a quadratic log likelihood to the features of ``PayloadQuadratic``, shape (110,)."""
    return np.concatenate([quadratic.precision.ravel(), quadratic.information])


def unpack(features: Array) -> Quadratic:
    """Converts the features of ``PayloadQuadratic``, shape (110,), to a quadratic log likelihood."""
    size = NUM_PARAMETERS**2
    return Quadratic(features[:size].reshape(NUM_PARAMETERS, NUM_PARAMETERS), features[size:])


def gather(geometry: Geometry, columns: Sequence[int]) -> Geometry:
    """Adds up the geometry columns of parts with the same density. ``columns`` is the density index of each part."""
    selection = np.array(columns)[:, None] == np.arange(max(columns) + 1)
    return Geometry(geometry.Phi @ selection, geometry.Phi_errors @ selection)


FELT_MODELS: Mapping[str, type[FeltModel]] = {
    "weber": WeberNoise,
    "white": WhiteNoise,
    "payload": PayloadQuadratic,
}
# Largest magnitude of features: torques, [N m], for "weber"; products of torques, summed over up to a thousand
# joints, for "white"; information vector of a mass of 1e3 kg with a standard deviation of 1e-9 kg for "payload".
_FEATURE_MAX = {"weber": 1e6, "white": 1e15, "payload": 1e21}


@dataclass(frozen=True, eq=False)
class TrialEvidence:
    """Evidence of one trial with one object.

    Attributes:
        object_name: Name of the object.
        parts: Appearance of each of the P parts, in T.
        geometry: Geometry of the parts in T, one column per part: Phi (10, P), errors (G, 10, P).
        model: Measurement model.
        features: Features of the model, averaged over the trial, shape (num_features,).
        num_samples: Number of samples in the average.
        num_joints: Number of joints.
        robot: Name of the robot.
        fingerprint: Fingerprint of the robot's arm; empty if unknown.
        time: UTC time of the trial, ISO 8601 with microseconds.
        log_evidence: Log predictive density of the measurements under the belief before the trial.
        p_value: Predictive probability of an equal or lower log evidence under the belief before the trial.
        source: File of the recording, or description of the simulation.
        source_hash: Fingerprint of the recording; empty for a simulated trial.
        program: Version of the program that wrote the record.

    Example:
        >>> from affordance import MODELS, TrialRunner, load_tools
        >>> from affordance.extensions.memory.simulated_trial import describe_trial
        >>> rod, *_ = load_tools(MODELS / "tools" / "weight.yaml")
        >>> runner = TrialRunner()
        >>> evidence = describe_trial(runner.run_hold(rod, runner.start_memory(), duration=0.5, seed=1))
        >>> evidence.object_name, evidence.num_samples
        ('rod_10cm', 5)
    """

    object_name: str
    parts: tuple[PartAppearance, ...]
    geometry: Geometry
    model: FeltModel
    features: Array
    num_samples: int
    num_joints: int
    robot: str
    fingerprint: str = ""
    time: str = field(default_factory=lambda: show_time(datetime.now(UTC)))
    log_evidence: float = 0.0
    p_value: float = 1.0
    source: str = ""
    source_hash: str = ""
    program: str = __version__

    def __post_init__(self) -> None:
        """Checks all attributes.

        Raises:
            BadArgumentError: A value is not finite, out of bounds, or of the wrong type or shape; or the precision
                matrix of the measurement is not symmetric positive semidefinite.
        """
        run_check("object_name", _NAME.check, self.object_name)
        run_check("robot", _LONG_NAME.check, self.robot)
        for name in ("fingerprint", "source", "source_hash", "program"):
            if getattr(self, name) != "":
                run_check(name, _LONG_NAME.check, getattr(self, name))
        object.__setattr__(self, "num_samples", check_whole("num_samples", self.num_samples, _COUNTS))
        object.__setattr__(self, "num_joints", check_whole("num_joints", self.num_joints, _JOINTS))
        log_evidence = check_number("log_evidence", self.log_evidence, -_LOG_MAX, _LOG_MAX)
        object.__setattr__(self, "log_evidence", log_evidence)
        object.__setattr__(self, "p_value", check_number("p_value", self.p_value, 0.0, 1.0))
        check_kind("model", self.model, tuple(FELT_MODELS.values()), "WeberNoise() makes one")
        object.__setattr__(self, "time", read_time("time", self.time))
        if not 1 <= len(self.parts) <= _MOST_PARTS:
            raise BadArgumentError("parts", "", f"holds {len(self.parts)}, must hold from 1 to {_MOST_PARTS}")
        parts = tuple(_check_part(f"parts[{i}]", part) for i, part in enumerate(self.parts))
        object.__setattr__(self, "parts", parts)
        object.__setattr__(self, "geometry", _check_geometry(self.geometry, len(parts)))
        shape = (self.model.num_features(self.num_joints or len(parts)),)
        most = _FEATURE_MAX[self._model_name]
        features = _check_bounded("features", self.features, shape, -most, most)
        object.__setattr__(self, "features", features)
        self._check_precision()

    def _check_precision(self) -> None:
        """Checks that the precision matrix of the ten parameters is positive semidefinite.

        Weber noise needs no check, because its precision matrix is positive semidefinite by construction.

        Raises:
            BadArgumentError: The matrix is not symmetric positive semidefinite.
        """
        if isinstance(self.model, WeberNoise):
            return
        # The features of white noise begin with the same matrix, which is symmetric except for rounding.
        precision = unpack(self.features[: NUM_PARAMETERS * (NUM_PARAMETERS + 1)]).precision
        if isinstance(self.model, PayloadQuadratic):
            check_symmetry("features", precision)
        least, largest = np.linalg.eigvalsh(0.5 * (precision + precision.T))[[0, -1]]
        if least < -_ROUNDING * max(largest, 0.0):
            problem = f"has a precision with the eigenvalue {least:.3g}, must be positive semidefinite"
            raise BadArgumentError("features", "", problem)

    @property
    def _model_name(self) -> str:
        return next(name for name, kind in FELT_MODELS.items() if isinstance(self.model, kind))

    @cached_property
    def id(self) -> str:
        """Digest of the recording or, without a recording, of the features; it identifies the trial."""
        digest = hashlib.sha256(self.source_hash.encode() or self._digest_content())
        return digest.hexdigest()[:24]

    @cached_property
    def digest(self) -> str:
        """Digest of the whole record, for detecting changes."""
        content = self._list_content()
        arrays = [content.pop(name).tobytes() for name in _ARRAYS]
        return hashlib.sha256(b"".join(arrays) + json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]

    def _digest_content(self) -> bytes:
        arrays = (self.features, self.geometry.Phi, self.geometry.Phi_errors)
        named = json.dumps([self.object_name, self.num_samples, [part.colour for part in self.parts]])
        return b"".join(each.tobytes() for each in arrays) + named.encode()

    def describe(self, geometry: Geometry) -> Felt:
        """Converts the measurements to evidence about the M densities of a geometry."""
        return self.model.describe(self.features, self.num_samples, self.num_joints, geometry)

    def to_dict(self) -> dict[str, Any]:
        """Returns the record as plain numbers and strings for JSON, in SI units."""
        content = self._list_content()
        return {**content, **{name: content[name].tolist() for name in _ARRAYS}, "digest": self.digest}

    def _list_content(self) -> dict[str, Any]:
        return {
            "id": self.id,
            "time": self.time,
            "robot": self.robot,
            "fingerprint": self.fingerprint,
            "object": self.object_name,
            "parts": [_list_values(part) for part in self.parts],
            "Phi": self.geometry.Phi,
            "Phi_errors": self.geometry.Phi_errors,
            "model": {"name": self._model_name, **vars(self.model)},
            "features": self.features,
            **{name: getattr(self, name) for name in PLAIN},
        }


_ARRAYS = ("Phi", "Phi_errors", "features")
_PART_SDS = ("colour_sd", "size_sd", "position_sd", "lightness_sd")
# Keys of a record that have the same names as the attributes.
PLAIN = ("num_samples", "num_joints", "log_evidence", "p_value", "source", "source_hash", "program")


def _check_part(name: str, part: PartAppearance) -> PartAppearance:
    """Checks the appearance of a part, and converts it to plain numbers."""
    check_kind(name, part, PartAppearance)
    sizes = _check_bounded(f"{name}.sizes", part.sizes, (None,), *_SIZES, " m")
    if not len(sizes):
        raise BadArgumentError(f"{name}.sizes", "", "is empty, must hold at least one length")
    x, y, z = _check_bounded(f"{name}.position", part.position, (3,), -_SIZES[1], _SIZES[1], " m").tolist()
    sds = (check_number(f"{name}.{each}", getattr(part, each), 0.0, _SD_MAX) for each in _PART_SDS)
    return PartAppearance(check_colour(f"{name}.colour", part.colour), tuple(sizes.tolist()), (x, y, z), *sds)


def _list_values(part: PartAppearance) -> dict[str, float | list[float]]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in part._asdict().items()}


def _check_geometry(geometry: Geometry, num_parts: int) -> Geometry:
    """Checks a geometry, and returns a read-only copy."""
    shape = (NUM_PARAMETERS, num_parts)
    Phi = _check_bounded("geometry.Phi", geometry.Phi, shape, -_MOMENT_MAX, _MOMENT_MAX)
    _check_bounded("geometry.Phi[0]", Phi[0], (num_parts,), _VOLUME_MIN, _MOMENT_MAX, " m^3")
    errors = _check_bounded("geometry.Phi_errors", geometry.Phi_errors, (None, *shape), -_MOMENT_MAX, _MOMENT_MAX)
    return Geometry(Phi, errors)


def _check_bounded(
    name: str, values: ArrayLike, shape: Sequence[int | None], low: float, high: float, unit: str = ""
) -> Array:
    """Checks shape and bounds of an array, and returns a read-only copy."""
    array = check_array(name, values, shape).copy()
    for place in np.argwhere((array < low) | (array > high))[:1]:
        where = "".join(f"[{each}]" for each in place)
        problem = f"is {array[tuple(place)]:g}, must be from {low:g} to {high:g}{unit}"
        raise BadArgumentError(f"{name}{where}", "", problem)
    array.setflags(write=False)
    return array


class _PartEntry(DataModel):
    """Part of an object in a record."""

    colour: list[float]
    sizes: list[float]
    position: list[float]
    colour_sd: float = 0.0
    size_sd: float = 0.0
    position_sd: float = 0.0
    lightness_sd: float = 0.0


class _TrialEntry(DataModel):
    """Record of a trial in a ledger or a file."""

    id: str
    time: str
    robot: str
    fingerprint: str
    object: str
    parts: list[_PartEntry]
    Phi: list[list[float]]
    Phi_errors: list[list[list[float]]]
    model: dict[str, str | bool | float]
    features: list[float]
    num_samples: int
    num_joints: int
    log_evidence: float
    p_value: float
    source: str
    source_hash: str
    program: str
    digest: str

    def build(self) -> TrialEvidence:
        """Builds the evidence.

        Raises:
            BadArgumentError: A value is invalid, or the id or digest does not match the content.
        """
        numbers = dict(self.model)
        name = numbers.pop("name", "")
        if name not in FELT_MODELS:
            raise BadArgumentError("model.name", "", describe_choice(name, FELT_MODELS))
        try:
            model = FELT_MODELS[str(name)](**numbers)
        except TypeError as error:
            raise BadArgumentError("model", "", f"does not fit {name}: {error}") from error
        size = len(self.parts)
        errors = np.zeros((0, NUM_PARAMETERS, size))
        if self.Phi_errors:
            errors = check_array("geometry.Phi_errors", self.Phi_errors, (None, NUM_PARAMETERS, size))
        trial = TrialEvidence(
            object_name=self.object,
            parts=tuple(PartAppearance(**vars(part)) for part in self.parts),
            geometry=Geometry(check_array("geometry.Phi", self.Phi, (NUM_PARAMETERS, size)), errors),
            model=model,
            features=np.array(self.features),
            robot=self.robot,
            fingerprint=self.fingerprint,
            time=self.time,
            **{name: getattr(self, name) for name in PLAIN},
        )
        if trial.id != self.id:
            raise BadArgumentError("id", "", f"is {self.id!r}, must be {trial.id!r}, the digest of the content")
        if trial.digest != self.digest:
            problem = f"is {self.digest!r}, must be {trial.digest!r}, the digest of the record, which was changed"
            raise BadArgumentError("digest", "", problem)
        return trial


def read_record(path: Path, key: str, text: str) -> TrialEvidence:
    """Reads a record from its JSON text.

    Raises:
        BadValueError: The record is invalid. The message contains the file or database and the key.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, key, f"is not JSON: {error}") from error
    entry = check_content(path, key, content, _TrialEntry)
    try:
        return entry.build()
    except BadArgumentError as error:
        where = ".".join(each for each in (key, str(error.source), error.key) if each)
        raise BadValueError(path, where, error.problem) from error


def show_time(moment: datetime) -> str:
    """Formats a time in UTC, ISO 8601 with microseconds, so that strings sort chronologically."""
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def read_time(name: str, text: str) -> str:
    """Parses a date or time, and formats it like ``show_time``.

    Args:
        name: Name of the argument in messages.
        text: Date or time, in UTC unless it has an offset.

    Raises:
        BadArgumentError: The text is not a time, or the time is before the first allowed year.
    """
    try:
        moment = datetime.fromisoformat(text)
        moment = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC)
    except (TypeError, ValueError, OverflowError) as error:
        problem = f"is {show_value(text)}, must be a time such as 2026-03-01T12:00"
        raise BadArgumentError(name, "", problem) from error
    if moment.year < _FIRST_YEAR:
        raise BadArgumentError(name, "", f"is {show_value(text)}, must be in {_FIRST_YEAR} or later")
    return show_time(moment)
