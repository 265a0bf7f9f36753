"""The record of a trial: what happened, and what was believed after it."""

from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.object_belief import Memory
from affordance.control.systems import ControlCounts
from affordance.notebook import build_table
from affordance.proprioception.systems import SampleCounts
from affordance.simulation.diagram import OUTLIER_P_VALUE
from affordance.simulation.posterior_log import LoggedPosterior


class TrialRecord(NamedTuple):
    """What happened in a trial of N logged times.

    Attributes:
        times: (N,), [s].
        q: Joint angles, (N, num_joints), [rad].
        v: Joint velocities, (N, num_joints), [rad/s].
        tau: Torques over the control period that ends at each time (zero at t = 0), (N, num_joints), [N m].
        height_centre: Height of the tool's geometric centre above where it was at t = 0, (N,), [m].
        height_grip: The same of the grip To, (N,), [m].
        height_com: The same of the true centre of mass, (N,), [m].
        memory: What is believed of all materials after the trial.
        log_evidence: Log probability density of the measurements before they were made.
        counts: In how many control periods a limit was active, and in how many the solver failed to find a plan. A
            plan is found whatever the object weighs; whether it can be held at all is said by ``overloaded``.
        p_value: Probability of measurements as surprising as these, under what was believed before the trial.
        samples: How many samples of the torques were accepted, and how many rejected and why.
        overloaded: Names of joints that cannot bear the arm with the object at rest where the trial begins: it sinks
            whatever is believed.
        posteriors: What was believed of the object as the trial went on, if the settings ask for that log.
    """

    times: Array
    q: Array
    v: Array
    tau: Array
    height_centre: Array
    height_grip: Array
    height_com: Array
    memory: Memory
    log_evidence: float
    counts: ControlCounts
    p_value: float = 1.0
    samples: SampleCounts = SampleCounts(0, 0, 0, 0)
    overloaded: tuple[str, ...] = ()
    posteriors: tuple[LoggedPosterior, ...] = ()

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {value}" for name, value in self._list_facts())
        return f"TrialRecord({facts})"

    def _repr_html_(self) -> str:
        return build_table("Trial", ["what", "value"], self._list_facts())

    def _list_facts(self) -> list[tuple[str, str]]:
        """The trial in a few lines: what, and how much."""
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
        """Whether the trial is a 5-sigma outlier: a decoy, a broken sensor, or a wrong model."""
        return self.p_value < OUTLIER_P_VALUE
