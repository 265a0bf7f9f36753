"""Evidence of one trial, as a ledger stores it: observed features and measured torques, without beliefs.

Frames: T the frame in which the object's parts are given, and about whose origin its ten parameters are.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from affordance.arguments import check_array, check_colour, check_kind, check_number, check_symmetry, check_whole
from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.exceptions import BadArgumentError, describe_choice
from affordance.files.atomic import to_plain
from affordance.files.constraints import Whole
from affordance.files.data_model import DataModel
from affordance.memory.felt_models import MeanDensities, PayloadQuadratic, unpack
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.version import __version__

# Rounding that a precision may have below zero, as a share of its largest eigenvalue.
_ROUNDING = 1e-9
_COUNTS = Whole(1, 1_000_000_000)
_JOINTS = Whole(0, 1000)
_MOST_PARTS = 1000
# Bounds of lengths in records, [m]: shorter and longer ones are in other units.
_SIZES = 1e-4, 10.0


class FeltModel(Protocol):
    """Model of what was felt: the likelihood of an object's densities given features of a trial."""

    def num_features(self, num_joints: int) -> int:
        """Returns the length of the feature vector."""

    def compute_likelihood(
        self, features: Array, num_samples: int, num_joints: int, geometry: Geometry, rho: Array
    ) -> Likelihood:
        """Computes the likelihood, errors evaluated at densities rho, (M,); see ``NoiseModel``."""


FELT_MODELS: Mapping[str, type[FeltModel]] = {
    "weber": WeberNoise,
    "white": WhiteNoise,
    "payload": PayloadQuadratic,
    "mean_densities": MeanDensities,
}


@dataclass(frozen=True, eq=False)
class TrialEvidence:
    """Evidence of one trial with one object.

    Attributes:
        object_name: Name of the object.
        parts: Appearance of each of its P parts, in T.
        geometry: Geometry of the parts in T, a column for each: Phi (10, P), errors (G, 10, P).
        model: Model of what was felt.
        features: Features of the model, averaged over the trial, shape (num_features,).
        num_samples: Number of samples in the average.
        num_joints: Number of joints.
        robot: Name of the robot.
        fingerprint: Text by which the robot's arm is recognised; empty if unknown.
        time: UTC time of the trial, ISO 8601 with microseconds.
        log_evidence: Log probability density of what was felt, given what was believed before.
        p_value: Probability of evidence as low as this, given what was believed before.
        source: File of the recording, or description of the simulation.
        source_hash: Text by which the recording is recognised; empty for a simulated trial.
        program: Version of the program that wrote the record.
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
        """Raises a BadArgumentError for values that are not finite or out of bounds, or of another kind or shape.

        A felt precision that is not symmetric and positive semidefinite raises a BadArgumentError, too.
        """
        check_whole("num_samples", self.num_samples, _COUNTS)
        check_whole("num_joints", self.num_joints, _JOINTS)
        object.__setattr__(self, "log_evidence", check_number("log_evidence", self.log_evidence))
        object.__setattr__(self, "p_value", check_number("p_value", self.p_value, 0.0, 1.0))
        check_kind("model", self.model, tuple(FELT_MODELS.values()), "WeberNoise() makes one")
        object.__setattr__(self, "time", read_time("time", self.time))
        if not 1 <= len(self.parts) <= _MOST_PARTS:
            raise BadArgumentError("parts", "", f"holds {len(self.parts)}, must hold from 1 to {_MOST_PARTS}")
        for i, part in enumerate(self.parts):
            check_colour(f"parts[{i}].colour", part.colour)
        num_parts = len(self.parts)
        Phi = check_array("geometry.Phi", self.geometry.Phi, (NUM_PARAMETERS, num_parts))
        check_array("geometry.Phi_errors", self.geometry.Phi_errors, (None, NUM_PARAMETERS, num_parts))
        for i, volume in enumerate(Phi[0]):
            if not volume > 0.0:
                raise BadArgumentError(f"geometry.Phi[0][{i}]", "", f"is {volume:g}, must be a volume above 0 m^3")
        length = self.model.num_features(self.num_joints or num_parts)
        check_array("features", self.features, (length,))
        if not isinstance(self.model, MeanDensities):
            precision = self.compute_likelihood(BODY, np.zeros(NUM_PARAMETERS)).precision
            check_array("features", precision, (NUM_PARAMETERS, NUM_PARAMETERS))
            if isinstance(self.model, PayloadQuadratic):  # which widens it, and makes it symmetric thereby
                check_symmetry("features", unpack(self.features).precision)
            eigenvalues = np.linalg.eigvalsh(precision)
            if eigenvalues[0] < -_ROUNDING * max(eigenvalues[-1], 0.0):
                problem = f"has a precision with the eigenvalue {eigenvalues[0]:.3g}, must be positive semidefinite"
                raise BadArgumentError("features", "", problem)

    @cached_property
    def id(self) -> str:
        """Digest of what was recorded, by which a trial counts once: of the recording, else of what was felt."""
        digest = hashlib.sha256(self.source_hash.encode() or self._digest_content())
        return digest.hexdigest()[:24]

    @cached_property
    def digest(self) -> str:
        """Digest of the whole record, by which a change of it is noticed."""
        content = self._list_content()
        arrays = [np.ascontiguousarray(content.pop(name), dtype=float).tobytes() for name in _ARRAYS]
        text = json.dumps(to_plain(content), sort_keys=True)
        return hashlib.sha256(b"".join(arrays) + text.encode()).hexdigest()[:24]

    def _digest_content(self) -> bytes:
        arrays = (self.features, self.geometry.Phi, self.geometry.Phi_errors)
        colours = _to_floats([part.colour for part in self.parts])
        named = json.dumps(to_plain([self.object_name, self.num_samples, colours]))
        return b"".join(np.ascontiguousarray(each, dtype=float).tobytes() for each in arrays) + named.encode()

    def compute_likelihood(self, geometry: Geometry, rho: Array) -> Likelihood:
        """Computes the likelihood of densities for a geometry with M columns, errors evaluated at rho, (M,)."""
        return self.model.compute_likelihood(self.features, self.num_samples, self.num_joints, geometry, rho)

    def to_dict(self) -> dict[str, Any]:
        """Returns the record as plain numbers and texts, for JSON; SI units."""
        plain: dict[str, Any] = to_plain({**self._list_content(), "digest": self.digest})
        return plain

    def _list_content(self) -> dict[str, Any]:
        name = next(name for name, kind in FELT_MODELS.items() if isinstance(self.model, kind))
        return {
            "id": self.id,
            "time": self.time,
            "robot": self.robot,
            "fingerprint": self.fingerprint,
            "object": self.object_name,
            "parts": _to_floats(self.parts),
            "Phi": self.geometry.Phi,
            "Phi_errors": self.geometry.Phi_errors,
            "model": {"name": name, **_to_floats(self.model)},
            "features": self.features,
            **{name: getattr(self, name) for name in _PLAIN},
        }


# The geometry of a body whose "densities" are its ten parameters.
BODY = Geometry(np.eye(NUM_PARAMETERS), np.zeros((0, NUM_PARAMETERS, NUM_PARAMETERS)))
_ARRAYS = ("Phi", "Phi_errors", "features")
_PLAIN = ("num_samples", "num_joints", "log_evidence", "p_value", "source", "source_hash", "program")


class _PartEntry(DataModel):
    """Part in a record."""

    colour: list[float]
    sizes: list[float]
    position: list[float]
    colour_sd: float = 0.0
    size_sd: float = 0.0
    position_sd: float = 0.0
    lightness_sd: float = 0.0

    def build(self, name: str) -> PartAppearance:
        """Builds the appearance; raises a BadArgumentError for a wrong shape, or a number out of bounds."""
        sizes = check_array(f"{name}.sizes", self.sizes, (None,))
        if not len(sizes) or not (sizes > 0.0).all():
            raise BadArgumentError(f"{name}.sizes", "", f"is {self.sizes}, must be lengths above 0 m")
        for i, size in enumerate(sizes):
            check_number(f"{name}.sizes[{i}]", size, *_SIZES, "m")
        for i, coordinate in enumerate(self.position):
            check_number(f"{name}.position[{i}]", coordinate, -_SIZES[1], _SIZES[1], "m")
        x, y, z = (float(each) for each in check_array(f"{name}.position", self.position, (3,)))
        sds = (self.colour_sd, self.size_sd, self.position_sd, self.lightness_sd)
        for each, value in zip(("colour_sd", "size_sd", "position_sd", "lightness_sd"), sds, strict=True):
            check_number(f"{name}.{each}", value, 0.0)
        colour = check_colour(f"{name}.colour", self.colour)
        return PartAppearance(colour, tuple(float(each) for each in sizes), (x, y, z), *sds)


class TrialEntry(DataModel):
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
        """Builds the evidence; raises a BadArgumentError for invalid values, or another id or digest than theirs."""
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
            parts=tuple(part.build(f"parts[{i}]") for i, part in enumerate(self.parts)),
            geometry=Geometry(check_array("geometry.Phi", self.Phi, (NUM_PARAMETERS, size)), errors),
            model=model,
            features=np.array(self.features),
            robot=self.robot,
            fingerprint=self.fingerprint,
            time=self.time,
            **{name: getattr(self, name) for name in _PLAIN},
        )
        if trial.id != self.id:
            raise BadArgumentError("id", "", f"is {self.id!r}, must be {trial.id!r}, the digest of the content")
        if trial.digest != self.digest:
            problem = f"is {self.digest!r}, must be {trial.digest!r}, that of the record; it was changed"
            raise BadArgumentError("digest", "", problem)
        return trial


def _to_floats(value: Any) -> Any:
    """Converts to JSON types with floats in place of whole numbers, as they are when a record is read."""
    plain = to_plain(value)
    if isinstance(plain, dict):
        return {key: _to_floats(entry) for key, entry in plain.items()}
    if isinstance(plain, list):
        return [_to_floats(entry) for entry in plain]
    return float(plain) if isinstance(plain, int) and not isinstance(plain, bool) else plain


def show_time(moment: datetime) -> str:
    """Formats a time in UTC, ISO 8601 with microseconds, so that texts sort by time."""
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def read_time(name: str, text: str) -> str:
    """Reads a date or a time, UTC unless it says otherwise, for ``show_time``; else raises a BadArgumentError."""
    try:
        moment = datetime.fromisoformat(text)
        return show_time(moment if moment.tzinfo else moment.replace(tzinfo=UTC))
    except (TypeError, ValueError, OverflowError) as error:
        raise BadArgumentError(name, "", f"is {text!r}, must be a time such as 2026-03-01T12:00") from error
