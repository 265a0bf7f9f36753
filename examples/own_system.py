"""Example of a LeafSystem in the Diagram that reads the estimator's posterior during a hold.

Prints:

    after 0.0 s it is believed to weigh 0.07 to 0.24 kg
    after 0.5 s it is believed to weigh 0.35 to 0.41 kg
    after 1.0 s it is believed to weigh 0.35 to 0.41 kg
    it weighs 0.40 kg; brass: 7258 to 8741 kg/m^3
"""

from pydrake.systems.framework import Context, DiagramBuilder

from affordance import MODELS, TrialRunner, load_tools
from affordance.drake.sampled_system import SampledSystem


class MassWatch(SampledSystem):
    """Prints the believed mass twice a second."""

    def __init__(self) -> None:
        super().__init__()
        self._posterior = self.declare_object_input("posterior")
        self.DeclarePeriodicPublishEvent(0.5, 0.0, self._print)

    def _print(self, context: Context) -> None:
        belief = self._posterior.Eval(context)
        (volume,) = belief.geometry.Phi[0]  # the first inertial parameter, mass, per unit density
        low, high = volume * belief.densities.compute_percentiles([0.25, 0.75]).ravel()
        print(f"after {context.get_time():.1f} s it is believed to weigh {low:.2f} to {high:.2f} kg")


rod, *_ = load_tools(MODELS / "tools" / "weight.yaml")
runner = TrialRunner()
trial = runner.get_diagram()

builder = DiagramBuilder()
# Figure 2 of the paper. Its outputs are features, measured_tau, measured_state, measured_vdot and the posterior.
paper = builder.AddNamedSystem("paper", trial.diagram)
watch = builder.AddNamedSystem("mass_watch", MassWatch())
builder.Connect(paper.GetOutputPort("posterior"), watch.GetInputPort("posterior"))
trial.diagram = builder.Build()  # the trial now sets up and runs the new Diagram

simulator = trial.prepare(trial.diagram.CreateDefaultContext(), rod, trial.hold, runner.start_memory(), seed=0)
record = trial.finish(simulator, rod, duration=1.0)
brass = record.memory.density("brass")
print(f"it weighs {rod.mass:.2f} kg; brass: {brass.p25:.0f} to {brass.p75:.0f} kg/m^3")
