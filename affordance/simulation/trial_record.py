"""Record of a trial: motion, torques and belief."""

from pathlib import Path
from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import ControlCounts
from affordance.files.html_table import build_table
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.proprioception.systems import SampleCounts
from affordance.proprioception.torque_noise import NoiseModel
from affordance.simulation.posterior_log import LoggedPosterior
from affordance.vision.features import ComponentFeatures


class Percept(NamedTuple):
    """Features of a held object in the hand frame, and statistics of the measured torques."""

    object_name: str
    features: tuple[ComponentFeatures, ...]
    statistics: TorqueStatistics
    noise: NoiseModel
    num_joints: int
    arm: Path


class TrialRecord(NamedTuple):
    """Record of a trial with N logged times.

    Attributes:
        times: Logged times, (N,), [s].
        q: Joint angles, (N, num_joints), [rad].
        v: Joint velocities, (N, num_joints), [rad/s].
        tau: Torques in the control period before each time, zero at t = 0, (N, num_joints), [N m].
        height_centre: Height of the tool's geometric centre above its position at t = 0, (N,), [m].
        height_grip: Height of the grip To above its position at t = 0, (N,), [m].
        height_com: Height of the true centre of mass above its position at t = 0, (N,), [m].
        memory: Memory after the trial.
        log_evidence: Log prior predictive density of the measurements.
        counts: Numbers of control periods with an active limit, and with a failure of the planner. A plan can exist
            even if the object is too heavy to be held (``overloaded``).
        p_value: Predictive probability, before the trial, of measurements with at most this evidence.
        samples: Numbers of torque samples that were accepted, and that were rejected for each reason.
        overloaded: Names of joints that are too weak to hold arm and object at rest at the start of the trial. If
            there are any, the arm sinks with any belief.
        posteriors: Beliefs about the object during the trial, if the settings have a log period for them.
        percept: Percept of the object; None if no torque sample was accepted.

    Example:
        >>> from affordance import MODELS, TrialRunner, load_tools
        >>> *_, decoy = load_tools(MODELS / "tools" / "weight.yaml")
        >>> runner = TrialRunner()
        >>> record = runner.run_hold(decoy, runner.start_memory(), duration=0.5, seed=1)
        >>> record.is_outlier, record.counts.failed
        (False, 0)
    """

    times: Array
    q: Array
    v: Array
    tau: Array
    height_centre: Array
    height_grip: Array
    height_com: Array
    memory: MaterialMemory
    log_evidence: float
    counts: ControlCounts
    p_value: float = 1.0
    samples: SampleCounts = SampleCounts(0, 0, 0, 0)
    overloaded: tuple[str, ...] = ()
    posteriors: tuple[LoggedPosterior, ...] = ()
    percept: Percept | None = None

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {value}" for name, value in self._list_facts())
        return f"TrialRecord({facts})"

    def _repr_html_(self) -> str:
        return build_table("Trial", ["what", "value"], self._list_facts())

    def _list_facts(self) -> list[tuple[str, str]]:
        """Lists the main results as names and values."""
        rows, joints = self.q.shape
        farthest = max(self.height_centre, key=abs)
        facts = [
            ("duration", f"{self.times[-1]:g} s, {rows} rows, {joints} joints"),
            ("farthest height", f"{100.0 * farthest:+.3g} cm"),
            ("p-value", f"{self.p_value:.2g}{', a 5-sigma outlier' if self.is_outlier else ''}"),
            ("samples", f"{self.samples.accepted} accepted, {self.samples.rejected} rejected"),
            ("memory", repr(self.memory)),
        ]
        return [*facts, ("overloaded", ", ".join(self.overloaded))] if self.overloaded else facts

    @property
    def is_outlier(self) -> bool:
        """True if the trial is a 5-sigma outlier, for example with a decoy, a broken sensor or a wrong model."""
        return self.p_value < OUTLIER_P_VALUE
