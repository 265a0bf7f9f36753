"""The one prior, noise model, controller and arm that serve all simulations, each with its source or reason.

They were fixed before any experiment was run and are not tuned to its outcome; docs/decisions/ tells why each is
what it is.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from pydrake.systems.analysis import SimulatorConfig

from affordance.belief.density_belief import PointEstimate, Prior
from affordance.belief.learner import Learner
from affordance.control.cost_measure import CostMeasure
from affordance.control.problem import MpcSettings
from affordance.plant.arm import ARM
from affordance.proprioception.faults import NO_FAULTS, Faults
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise
from affordance.vision.features import FeatureSource, VisionError


@dataclass(frozen=True)
class Settings:
    """Everything that is the same for all simulations.

    Attributes:
        arm: Drake model directives of the arm.
        prior: Of the density of a material that was never held.
        learner: What observers learn by; the paper's has one density for each colour.
        noise: Errors of measured joint torques.
        acceleration_sd: Standard deviation of the error of a measured joint acceleration, [rad/s^2]; the paper
            assumes that there is none.
        cost_measure: By what options are compared.
        vision_error: Errors of measured features; the paper assumes that there are none.
        feature_source: True features with errors, or features from pictures; vision_error is of the former.
        mpc: Horizon, steps and weights of the controller.
        angle_margin: Margin that the controller keeps to position limits, [rad].
        control_period: Time between two plans of the controller, [s].
        point_estimate: Which density stands for the belief in control.
        uses_posterior: Whether the controller uses the posterior as it grows (an extension) rather than the visual
            prior for the whole trial (the paper).
        sample_period: Time between two samples of proprioception, [s].
        log_period: Time between two rows of the logs, [s].
        posterior_log_period: Time between two entries of the log of the posterior, [s]; None for no such log.
        integration_scheme: One of Drake's implicit integrators.
        accuracy: Its target accuracy.
        stiff_accuracy: The same for an arm that damping brings to rest within a tick of the controller.
        max_step_size: Its largest step, [s].
        contact_scheme: The integrator while a tool may touch a nail, and from a second touch on.
        contact_accuracy: Its target accuracy.
        contact_max_step_size: Its largest step while the peak is looked for, [s].
        faults: What is wrong with sensors and arm; nothing, unless a user switches it on.
        learns_from_outliers: Whether a 5-sigma outlier teaches what Bayes' rule says (the paper), or
            nothing; it is flagged either way.
    """

    arm: Path = ARM
    # 1000: the density of water is about the average density of objects (Ross & Gregory 1970). 4000: broad; copper,
    # the densest metal in common use, lies two standard deviations above. 100: the spread within woods, brasses and
    # steels is 60 to 90 kg/m^3. docs/decisions/0003-prior.md
    prior: Prior = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)
    # The paper's. For an arm that is to work: belief.learners.ARM_LEARNER.
    learner: Learner = Learner.DENSITY
    # 0.07: force felt by hand and arm (Pang, Tan & Durlach 1991; Jones, Hunter & Irwin 1992). 0.097 N m: smallest
    # torque felt at the elbow (Kim & Asbeck 2021). docs/decisions/0004-noise.md
    noise: NoiseModel = WeberNoise(weber_fraction=0.07, threshold=0.097)
    acceleration_sd: float = 0.0
    cost_measure: CostMeasure = CostMeasure.WORK
    vision_error: VisionError = VisionError()
    feature_source: FeatureSource = FeatureSource.FEATURES
    # 0.24 s: one cycle of perceiving, deciding and moving in a correction (Card, Moran & Newell 1983).
    # docs/decisions/0005-controller.md
    mpc: MpcSettings = MpcSettings(horizon=0.24, num_steps=12)
    # A limit is kept only as well as the believed inertia is right: without a margin it is violated by up to 2.3
    # mrad. docs/decisions/0009-limits-as-met.md
    angle_margin: float = math.radians(0.25)
    # Stable for a believed inertia 16 times the true one, with half as much again to spare: T > 2 x period x 16.
    control_period: float = 0.005
    point_estimate: PointEstimate = PointEstimate.MODE
    uses_posterior: bool = False
    # Every sample is an exact linear observation of the same object: at 10 Hz the mean differs from that at 100 Hz
    # by a thousandth, a hundredth of its own uncertainty. docs/decisions/0008-percept-as-state.md
    sample_period: float = 0.1
    log_period: float = 0.01
    posterior_log_period: float | None = None
    # Chosen by the table of docs/decisions/0007-integration.md.
    integration_scheme: str = "radau3"
    accuracy: float = 1e-4
    # Each tick's step of torque starts a transient that is over before it moves anything: an integrator that is to
    # follow it takes three times as many steps. Chosen by the table of docs/decisions/0023-stiff-arms.md.
    stiff_accuracy: float = 1e-3
    max_step_size: float = 0.1
    # Chosen by the table of docs/decisions/0013-nail.md.
    contact_scheme: str = "implicit_euler"
    contact_accuracy: float = 1e-3
    contact_max_step_size: float = 1e-4
    faults: Faults = NO_FAULTS
    learns_from_outliers: bool = True

    @property
    def simulator(self) -> SimulatorConfig:
        """Drake's configuration of the simulator."""
        return _configure(self.integration_scheme, self.accuracy, self.max_step_size)

    @property
    def stiff_simulator(self) -> SimulatorConfig:
        """The same for an arm that damping brings to rest within a tick of the controller."""
        return _configure(self.integration_scheme, self.stiff_accuracy, self.max_step_size)

    @property
    def contact_simulator(self) -> SimulatorConfig:
        """The same while a tool may touch a nail."""
        return _configure(self.contact_scheme, self.contact_accuracy, self.contact_max_step_size)

    @property
    def second_touch_simulator(self) -> SimulatorConfig:
        """The same once a tool touches a nail again on its way back: the peak, which needs short steps, is over."""
        return _configure(self.contact_scheme, self.contact_accuracy, self.max_step_size)


def _configure(integration_scheme: str, accuracy: float, max_step_size: float) -> SimulatorConfig:
    return SimulatorConfig(
        integration_scheme=integration_scheme, accuracy=accuracy, max_step_size=max_step_size, use_error_control=True
    )


DEFAULT_SETTINGS = Settings()
