"""Settings shared by all simulations, such as prior, noise model, controller and arm.

docs/decisions/ gives a source or reason for each. Most were fixed before any experiment was run. Exceptions are
listed in docs/trust.md: the mode of the prior was chosen after looking at the paper's figure 4, and others were
changed after seeing results of this program. A setting is a field with its bounds, unit and source;
``named_settings`` accesses settings by name.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydrake.systems.analysis import GetIntegrationSchemes, SimulatorConfig

from affordance.belief.density_belief import PointEstimate, Prior
from affordance.belief.learner import Learner
from affordance.belief.learners import DENSITY, check_learner
from affordance.control.cost_measure import CostMeasure
from affordance.control.problem import MpcSettings
from affordance.exceptions import BadArgumentError
from affordance.files.constraints import Checked, OneOf, Setting, Within, check_fields
from affordance.plant.arm import ARM
from affordance.proprioception.faults import NO_FAULTS, Faults
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise
from affordance.vision.eye import Eye, check_eye
from affordance.vision.features import VisionError

# Bounds that limit a simulation's time and memory; SECURITY.md gives both at each bound.
_PERIOD, _POSTERIOR_PERIOD = Within(1e-4, 60.0), Within(0.01, 60.0)
_ACCURACY = Within(1e-11, 1.0)
_STEP, _CONTACT_STEP = Within(1e-4, 10.0), Within(1e-5, 10.0)
_SCHEME = OneOf(tuple(GetIntegrationSchemes()))
_INTEGRATION = "chosen by the table of docs/decisions/0007-integration.md"
_CONTACT = "chosen by the table of docs/decisions/0013-nail.md"


@dataclass(frozen=True)
class Integrator:
    """Implicit integrators of Drake that simulate arm and tool.

    Attributes:
        scheme: Integrator of motions without contact.
        accuracy: Target accuracy of that integrator.
        stiff_accuracy: Target accuracy for an arm that damping brings to rest within a control period.
        max_step: Largest step of the integrators, [s].
        contact_scheme: Integrator while a tool may touch a nail, and after a second touch.
        contact_accuracy: Target accuracy of that integrator.
        contact_max_step: Largest step of that integrator around the peak of the force, [s].
        second_touch_accuracy: Target accuracy of that integrator once a tool touches the nail again.
    """

    scheme: Annotated[str, _SCHEME, Setting("", _INTEGRATION)] = "radau3"
    accuracy: Annotated[float, _ACCURACY, Setting("1", _INTEGRATION)] = 1e-4
    stiff_accuracy: Annotated[
        float,
        _ACCURACY,
        Setting(
            "1",
            "the step of torque in each control period starts a transient that decays before it moves anything; "
            "resolving it takes three times as many steps (table of docs/decisions/0007-integration.md)",
        ),
    ] = 1e-3
    max_step: Annotated[float, _STEP, Setting("s", _INTEGRATION)] = 0.1
    contact_scheme: Annotated[str, _SCHEME, Setting("", _CONTACT)] = "implicit_euler"
    contact_accuracy: Annotated[float, _ACCURACY, Setting("1", _CONTACT)] = 1e-3
    contact_max_step: Annotated[float, _CONTACT_STEP, Setting("s", _CONTACT)] = 1e-4
    second_touch_accuracy: Annotated[float, _ACCURACY, Setting("1", _CONTACT)] = 1e-2

    def __post_init__(self) -> None:
        """Checks all fields. An invalid value raises a BadArgumentError."""
        check_fields(self)

    @property
    def free(self) -> SimulatorConfig:
        """Configuration of Drake's simulator for motions without contact."""
        return _configure(self.scheme, self.accuracy, self.max_step)

    @property
    def stiff(self) -> SimulatorConfig:
        """Configuration for an arm that damping brings to rest within a control period."""
        return _configure(self.scheme, self.stiff_accuracy, self.max_step)

    @property
    def contact(self) -> SimulatorConfig:
        """Configuration while a tool may touch a nail."""
        return _configure(self.contact_scheme, self.contact_accuracy, self.contact_max_step)

    @property
    def second_touch(self) -> SimulatorConfig:
        """Configuration after a second touch of the nail, when long steps suffice again."""
        return _configure(self.contact_scheme, self.second_touch_accuracy, self.max_step)


def _configure(scheme: str, accuracy: float, max_step: float) -> SimulatorConfig:
    return SimulatorConfig(
        integration_scheme=scheme, accuracy=accuracy, max_step_size=max_step, use_error_control=True
    )


@dataclass(frozen=True)
class Settings:
    """Settings shared by all simulations.

    Attributes:
        arm: Drake model directives of the arm.
        prior: Prior of the density of a material that was never held.
        learner: Learner of all observers, or its name: "density", "kinds_map" or "kinds_drawn". The paper's learner
            has one density per colour. For robots, ``ARM_LEARNER`` in ``belief.learners`` is recommended.
        noise: Errors of measured joint torques.
        acceleration_sd: Standard deviation of the error of a measured joint acceleration, [rad/s^2]; zero in the
            paper.
        cost_measure: Measure by which options are compared.
        vision_error: Errors of measured features; zero in the paper.
        eye: Function that measures features, such as in pictures; None for the true ones with errors (vision_error).
        mpc: Horizon, steps and weights of the controller.
        angle_margin: Margin that the controller keeps from position limits, [rad].
        control_period: Time between two plans of the controller, [s].
        point_estimate: Point of the belief that the controller uses as the density, such as the most probable one.
        uses_posterior: True if the controller uses the posterior as it is updated within a trial (an extension);
            False to use the visual prior for the whole trial (the paper).
        sample_period: Time between two samples of proprioception, [s].
        log_period: Time between two rows of the logs, [s]. Drop, lift and deviation are extremes over these rows.
        posterior_log_period: Time between two entries of the log of the posterior, [s]; None for no such log.
        integrator: Schemes, accuracies and steps of Drake's simulator.
        faults: Faults of sensors and arm; none by default.
        learns_from_outliers: True to learn from a 5-sigma outlier by Bayes' rule (the paper), false to ignore it; it
            is flagged either way.

    Example:
        >>> from affordance import Settings, change_settings
        >>> change_settings(Settings(learner="kinds_map"), {"prior.sd": 8000}).prior.sd
        8000.0
    """

    arm: Path = ARM
    prior: Prior = Prior()
    learner: Annotated[Learner, Checked(check_learner), Setting("", "the paper's (docs/decisions/0026-kinds.md)")] = (
        DENSITY
    )
    noise: NoiseModel = WeberNoise()
    acceleration_sd: Annotated[float, Within(0.0, 100.0), Setting("rad/s^2", "the paper assumes none")] = 0.0
    cost_measure: Annotated[CostMeasure, Setting("", "paper, eq. 4")] = CostMeasure.WORK
    vision_error: VisionError = VisionError()
    eye: Annotated[Eye | None, Checked(check_eye)] = None
    mpc: MpcSettings = MpcSettings()
    angle_margin: Annotated[
        float,
        Within(0.0, 1.0),
        Setting(
            "rad",
            "a limit is kept only as well as the believed inertia is right: without a margin it is violated by up to "
            "2.3 mrad (docs/decisions/0005-controller.md)",
        ),
    ] = math.radians(0.25)
    control_period: Annotated[
        float,
        Within(1e-4, 0.1),
        Setting(
            "s",
            "stable for a believed inertia 16 times the true one, with a margin of a half: "
            "horizon > 2 x period x 16 (docs/decisions/0005-controller.md)",
        ),
    ] = 0.005
    point_estimate: Annotated[PointEstimate, Setting("", "the most probable density (paper, IV-A)")] = (
        PointEstimate.MODE
    )
    uses_posterior: Annotated[bool, Setting("", "the paper controls by the visual prior (docs/learning.md)")] = False
    sample_period: Annotated[
        float,
        _PERIOD,
        Setting(
            "s",
            "every sample is an exact linear observation of the same object: at 10 Hz the mean differs from that at "
            "100 Hz by a thousandth, a hundredth of its own uncertainty (docs/decisions/0005-controller.md)",
        ),
    ] = 0.1
    log_period: Annotated[float, _PERIOD, Setting("s", "fine enough for figures and for extremes over time")] = 0.01
    posterior_log_period: Annotated[
        Annotated[float, _POSTERIOR_PERIOD] | None, Setting("s", "no log unless it is asked for (docs/learning.md)")
    ] = None
    integrator: Integrator = Integrator()
    faults: Faults = NO_FAULTS
    learns_from_outliers: Annotated[bool, Setting("", "Bayes' rule (docs/decisions/0016-faults-and-surprise.md)")] = (
        True
    )

    def __post_init__(self) -> None:
        """Checks all fields, and converts texts to Enum members and paths.

        Raises:
            BadArgumentError: A field is of the wrong kind or out of bounds, or torques of unloaded joints have no
                error.
        """
        check_fields(self)
        if isinstance(self.noise, WeberNoise) and self.noise.threshold == 0.0:
            problem = "is 0, must be more than 0: a joint without torque would be felt exactly"
            raise BadArgumentError("Settings", "noise.threshold", problem)


DEFAULT_SETTINGS = Settings()
