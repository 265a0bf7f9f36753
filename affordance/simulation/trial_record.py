"""Record of a trial: motion, torques and the belief after it."""

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
    """Features of an object in the hand frame, and statistics of its torques."""

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
        tau: Torques over the control period that ends at each time, zero at t = 0, (N, num_joints), [N m].
        height_centre: Height of the tool's geometric centre above its position at t = 0, (N,), [m].
        height_grip: Height of the grip To above its position at t = 0, (N,), [m].
        height_com: Height of the true centre of mass above its position at t = 0, (N,), [m].
        memory: Belief about all materials after the trial.
        log_evidence: Log of the prior predictive density of the measurements.
        counts: Numbers of control periods in which a limit was active, and in which the solver found no plan. Plans
            do not show whether the object can be held at all, because they exist for any weight; see ``overloaded``.
        p_value: Probability of measurements at least as surprising as these, under the belief before the trial.
        samples: Numbers of torque samples that were accepted, and that were rejected for each reason.
        overloaded: Names of the joints that are too weak to hold arm and object at rest at the start of the trial;
            if there are any, the arm sinks whatever the belief.
        posteriors: Beliefs about the object during the trial, if the settings give them a log period.
        percept: Percept of the object; None if nothing was felt.

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
        """Lists the trial's main results as names and values."""
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
        """True if the trial is a 5-sigma outlier: a decoy, a broken sensor, or a wrong model."""
        return self.p_value < OUTLIER_P_VALUE
