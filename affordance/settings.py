"""Settings shared by all simulations, such as prior, noise model, controller and arm.

Each setting is a field with bounds, unit and source; ``named_settings`` accesses it by name. Sources and reasons are
in docs/decisions/. Most settings were fixed before any experiment was run, and docs/trust.md lists the exceptions:
the mode of the prior was chosen after looking at the paper's figure 4, and some settings were changed after seeing
results of this program.
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

# Bounds that limit a simulation's time and memory. SECURITY.md lists the time and memory at each bound.
_PERIOD, _POSTERIOR_PERIOD = Within(1e-4, 60.0), Within(0.01, 60.0)
_ACCURACY = Within(1e-11, 1.0)
_STEP, _CONTACT_STEP = Within(1e-4, 10.0), Within(1e-5, 10.0)
_SCHEME = OneOf(tuple(GetIntegrationSchemes()))
_INTEGRATION = "chosen from the table in docs/decisions/0007-integration.md"
_CONTACT = "chosen from the table in docs/decisions/0013-nail.md"


@dataclass(frozen=True)
class Integrator:
    """Implicit integrators of Drake that simulate arm and tool.

    Attributes:
        scheme: Integrator of motions without contact.
        accuracy: Target accuracy without contact.
        stiff_accuracy: Target accuracy without contact for an arm that damping stops within a control period.
        max_step: Largest step of the integrators, [s].
        contact_scheme: Integrator while a tool may touch a nail, and after a second touch.
        contact_accuracy: Target accuracy while a tool may touch a nail.
        contact_max_step: Largest step around the peak of the force, [s].
        second_touch_accuracy: Target accuracy after a tool touches the nail for the second time.
    """

    scheme: Annotated[str, _SCHEME, Setting("", _INTEGRATION)] = "radau3"
    accuracy: Annotated[float, _ACCURACY, Setting("1", _INTEGRATION)] = 1e-4
    stiff_accuracy: Annotated[
        float,
        _ACCURACY,
        Setting(
            "1",
            "the torque step at each control period causes a transient that decays before anything moves; "
            "resolving it takes three times as many steps (table in docs/decisions/0007-integration.md)",
        ),
    ] = 1e-3
    max_step: Annotated[float, _STEP, Setting("s", _INTEGRATION)] = 0.1
    contact_scheme: Annotated[str, _SCHEME, Setting("", _CONTACT)] = "implicit_euler"
    contact_accuracy: Annotated[float, _ACCURACY, Setting("1", _CONTACT)] = 1e-3
    contact_max_step: Annotated[float, _CONTACT_STEP, Setting("s", _CONTACT)] = 1e-4
    second_touch_accuracy: Annotated[float, _ACCURACY, Setting("1", _CONTACT)] = 1e-2

    def __post_init__(self) -> None:
        """Checks all fields.

        Raises:
            BadArgumentError: A value is invalid.
        """
        check_fields(self)

    @property
    def free(self) -> SimulatorConfig:
        """Configuration of Drake's simulator for motions without contact."""
        return _configure(self.scheme, self.accuracy, self.max_step)

    @property
    def stiff(self) -> SimulatorConfig:
        """Configuration for an arm that damping stops within a control period."""
        return _configure(self.scheme, self.stiff_accuracy, self.max_step)

    @property
    def contact(self) -> SimulatorConfig:
        """Configuration while a tool may touch a nail."""
        return _configure(self.contact_scheme, self.contact_accuracy, self.contact_max_step)

    @property
    def second_touch(self) -> SimulatorConfig:
        """Configuration after a second touch of the nail, when long steps are sufficient again."""
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
        prior: Prior of the density of unknown materials.
        learner: Learner of all observers, or its name: "density", "kinds_map" or "kinds_drawn". The paper's learner
            has one density per colour. For robots, ``ARM_LEARNER`` in ``belief.learners`` is recommended.
        noise: Errors of measured joint torques.
        acceleration_sd: Standard deviation of errors in measured joint accelerations, [rad/s^2]; zero in the paper.
        cost_measure: Cost that is compared between options.
        vision_error: Errors of measured features; zero in the paper.
        eye: Function that measures features, for example in pictures; None for the true features plus errors.
        mpc: Horizon, steps and weights of the controller.
        angle_margin: Margin that the controller keeps from position limits, [rad].
        control_period: Time between two plans of the controller, [s].
        point_estimate: Point estimate of the density that the controller uses, such as the mode of the belief.
        uses_posterior: True if the controller uses the posterior, which is updated during a trial (an extension);
            False to use the visual prior throughout the trial (the paper).
        sample_period: Time between two samples of proprioception, [s].
        log_period: Time between two rows of the logs, [s]. Drop, lift and deviation are extremes over these rows.
        posterior_log_period: Time between two entries in the log of the posterior, [s]; None for no log.
        integrator: Schemes, accuracies and steps of Drake's simulator.
        faults: Faults of sensors and arm; none by default.
        learns_from_outliers: True to learn from a 5-sigma outlier using Bayes' rule (the paper), False to ignore it.
            Outliers are flagged in both cases.

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
            "errors in the believed inertia cause violations, of up to 2.3 mrad without a margin "
            "(docs/decisions/0005-controller.md)",
        ),
    ] = math.radians(0.25)
    control_period: Annotated[
        float,
        Within(1e-4, 0.1),
        Setting(
            "s",
            "stable if the believed inertia is up to 16 times the true inertia: horizon > 2 x 16 x period "
            "(docs/decisions/0005-controller.md)",
        ),
    ] = 0.005
    point_estimate: Annotated[PointEstimate, Setting("", "the most probable density (paper, IV-A)")] = (
        PointEstimate.MODE
    )
    uses_posterior: Annotated[bool, Setting("", "the paper's controller uses the prior (docs/learning.md)")] = False
    sample_period: Annotated[
        float,
        _PERIOD,
        Setting(
            "s",
            "all samples are exact linear observations of the same object: the means at 10 Hz and 100 Hz differ by "
            "0.1 %, which is 1 % of the mean's uncertainty (docs/decisions/0005-controller.md)",
        ),
    ] = 0.1
    log_period: Annotated[float, _PERIOD, Setting("s", "fine enough for figures and for extremes over time")] = 0.01
    posterior_log_period: Annotated[
        Annotated[float, _POSTERIOR_PERIOD] | None, Setting("s", "no log unless requested (docs/learning.md)")
    ] = None
    integrator: Integrator = Integrator()
    faults: Faults = NO_FAULTS
    learns_from_outliers: Annotated[bool, Setting("", "Bayes' rule (docs/decisions/0016-faults-and-surprise.md)")] = (
        True
    )

    def __post_init__(self) -> None:
        """Checks all fields, and converts texts to Enum members and paths.

        Raises:
            BadArgumentError: A field is of the wrong type or out of bounds, or the noise vanishes for a joint without
                torque.
        """
        check_fields(self)
        if isinstance(self.noise, WeberNoise) and self.noise.threshold == 0.0:
            problem = "is 0, must be more than 0: the torque of an unloaded joint would have no error"
            raise BadArgumentError("Settings", "noise.threshold", problem)


DEFAULT_SETTINGS = Settings()
