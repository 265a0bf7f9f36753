"""Simulation II (paper, IV-B): the centre of mass of objects of equal weight.

Two objects of wood and steel, one the other turned around, are held again and again; what is learned of the materials
then serves to hold each of them once more, and a decoy that looks like the first and is made like the second.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.belief.object_belief import Memory
from affordance.experiments.definition import OBSERVER_SHOWN, Arrays, Outputs
from affordance.experiments.shared.checks import check_tools_can_be_held
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.learning_objects import load_learning_objects
from affordance.experiments.shared.trajectories import count_events, label_heights, label_motions, stack_heights
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.objects.tool import Tool, list_densities
from affordance.random_streams import Stream
from affordance.reporting import figures, statistics
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Scene, write_replay
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.diagram import OUTLIER_P_VALUE
from affordance.simulation.trial import TrialRecord, get_runner
from affordance.vision.observe import observe
from affordance.vision.visual_prior import predict_object

# Stands for observing an object without holding it, beside the draws of a trial, which count from 0.
_PREDICTED = 9


@dataclass(frozen=True)
class CentreOfMass:
    """Simulation II.

    Attributes:
        experience: The two honest objects, and how they are learned.
        decoy: Looks like the first and is made like the second.
    """

    experience: ExperienceConfig
    decoy: Tool

    name = "com"
    unit = "observer"
    section = Path(__file__).parent / "sections" / "com.yaml"

    @property
    def tools(self) -> tuple[Tool, ...]:
        """The objects of the test pass, the decoy last."""
        return (*self.experience.tools, self.decoy)

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """All objects."""
        return self.tools

    @property
    def seed(self) -> int:
        """Root of every random draw."""
        return self.experience.seed

    @property
    def settings(self) -> Settings:
        """What all simulations share."""
        return self.experience.settings

    def with_settings(self, settings: Settings) -> "CentreOfMass":
        """Returns the experiment with other settings."""
        return replace(self, experience=replace(self.experience, settings=settings))

    def count_repeats(self, observers: int) -> int:
        """One repeat an observer."""
        return observers

    def plan(self, jobs: int) -> None:
        """Nothing is shared."""

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience:
        """Lets observers hold the objects of Simulation II."""
        return collect_experience(self.experience, folder, repeats=repeats, jobs=jobs)

    def select_shared(self, plan: None) -> None:
        """Nothing is shared."""

    def run_test_pass(self, memory: Memory, repeat: int) -> list[TrialRecord]:
        """Holds each object once with what is believed; nothing is learned from it."""
        runner = get_runner(self.settings)
        return [
            runner.run_hold(
                tool, memory, duration=self.experience.duration, seed=(self.seed, repeat, Stream.TEST, trial)
            )
            for trial, tool in enumerate(self.tools)
        ]

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs an observer's test pass.

        Returns: Arrays over the three objects: ``times`` (N,), heights (3, N), counts (3,), and
            ``parameters_predicted`` (3, 10), at the most probable densities.
        """
        assert experience is not None  # the experiment has one
        memory = experience.recall(repeat, experience.num_trials)
        records = self.run_test_pass(memory, repeat)
        parameters = []
        for trial, tool in enumerate(self.tools):
            rng = np.random.default_rng([self.seed, repeat, Stream.TEST, trial, _PREDICTED])
            features = observe(tool, self.settings.feature_source, self.settings.vision_error, rng)
            belief = predict_object(features, memory, self.settings.prior)
            parameters.append(belief.compute_parameters(belief.densities.compute_mode()))
        return {**stack_heights(records), "parameters_predicted": np.array(parameters), **count_events(records)}

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        assert experience is not None  # the experiment has one
        excursion = statistics.compute_excursion(arrays["height_centre"])
        extreme = statistics.estimate_mean(excursion)
        deviation = statistics.estimate_mean(np.abs(excursion))
        true_com = np.array([tool.p_TTcm for tool in self.tools])
        # Of the two honest objects; the decoy is meant to be misjudged.
        predicted = arrays["parameters_predicted"][:, :2]
        true = np.array([tool.parameters for tool in self.tools[:2]])
        mass_error = np.abs(predicted[..., 0] / true[:, 0] - 1.0)
        com_error = np.linalg.norm(predicted[..., 1:4] / predicted[..., :1] - true_com[:2], axis=-1)
        inertia_error = np.linalg.norm(predicted[..., 4:7] - true[:, 4:7], axis=-1) / np.linalg.norm(
            true[:, 4:7], axis=-1
        )
        memories = [experience.recall(repeat, experience.num_trials) for repeat in range(experience.num_repeats)]
        medians = np.median([memory.belief.compute_percentiles([0.5])[0] for memory in memories], axis=0)
        parts = [part.material.name for tool in self.experience.tools for part in tool.components]
        names = list(dict.fromkeys(parts))  # in the order of the colours
        densities = list_densities(self.experience.tools)
        return {
            "mass_true": np.array([tool.mass for tool in self.tools]),
            "p_ToTcm_x_true": true_com[:, 0],
            "height_extreme_m": extreme.mean,
            "height_extreme_m_ci95": extreme.ci95,
            "deviation_m": deviation.mean,
            "deviation_m_ci95": deviation.ci95,
            "density_median": dict(zip(names, medians, strict=True)),
            "density_true": {name: densities[colour] for name, colour in zip(names, experience.colours, strict=True)},
            "mass_error": np.median(mass_error),
            "com_error_m": np.median(com_error),
            "inertia_error": np.median(inertia_error),
            "height_extreme_grip_m": statistics.compute_excursion(arrays["height_grip"]).mean(axis=0),
            "height_extreme_com_m": statistics.compute_excursion(arrays["height_com"]).mean(axis=0),
            "periods_limited": arrays["periods_limited"].sum(axis=0),
            "periods_failed": arrays["periods_failed"].sum(axis=0),
            "samples_rejected_test": arrays["rejected"].sum(axis=0),
            "trials_outlier_test": (arrays["p_value"] < OUTLIER_P_VALUE).sum(axis=0),
            "p_value_test": np.median(arrays["p_value"], axis=0),
        }

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Names of the objects, and how they are learned."""
        first, second, _ = self.tools
        return {
            "names": [tool.name for tool in self.tools],
            "first": first.name,
            "second": second.name,
            "num_trials": self.experience.num_trials,
            "duration": self.experience.duration,
        }

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Figures 5 and 6, trajectories, Diagram and replay."""
        assert experience is not None  # the experiment has one
        records = self.run_test_pass(experience.recall(OBSERVER_SHOWN, experience.num_trials), OBSERVER_SHOWN)
        trial = get_runner(self.settings).get_diagram(self.experience.duration)
        scenes = [
            Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg")
            for tool, record in zip(self.tools, records, strict=True)
        ]
        predicted = arrays["parameters_predicted"][..., 0]
        masses = LabelledArray(("repeat", "trial"), predicted, "kg", "mass predicted before the test pass")
        title = f"Simulation II, seed {self.seed}, after {experience.num_trials} trials"
        return Outputs(
            figures={"figure5": self._draw_objects, "figure6": partial(self._draw_heights, arrays)},
            trajectories=Trajectories(
                {
                    **label_heights(arrays),
                    "mass_predicted": masses,
                    **label_motions(records, f"observer {OBSERVER_SHOWN}"),
                },
                {"trial": [tool.name for tool in self.tools], "joint": trial.arm.joint_names},
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_replay(path, self.settings.arm, scenes, title=title),
        )

    def _draw_objects(self) -> Figure:
        first, second, decoy = self.tools
        drawings = [
            Drawing(first, f"1: {first.name}"),
            Drawing(second, f"2: {second.name}"),
            Drawing(decoy, f"3: {decoy.name}, as it looks"),
            Drawing(decoy, f"3: {decoy.name}, as it is made", as_made=True),
        ]
        return draw_objects(drawings, columns=2)

    def _draw_heights(self, arrays: Arrays) -> Figure:
        height = arrays["height_centre"]
        return figures.draw_heights_of_points(
            times=arrays["times"][0],
            shown=height[OBSERVER_SHOWN],
            mean=statistics.estimate_mean(height),
            decoy={
                "geometric centre": statistics.estimate_mean(height[:, 2]),
                "grip": statistics.estimate_mean(arrays["height_grip"][:, 2]),
                "true centre of mass": statistics.estimate_mean(arrays["height_com"][:, 2]),
            },
            labels=[f"{k + 1}: {tool.name}" for k, tool in enumerate(self.tools)],
            shown_label=f"seed {self.seed}, observer {OBSERVER_SHOWN}",
            num_repeats=len(height),
        )


def load(models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS) -> CentreOfMass:
    """Reads the objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    *honest, decoy = load_learning_objects(models)
    check_tools_can_be_held(models / "tools" / "com.yaml", (*honest, decoy), settings)
    return CentreOfMass(ExperienceConfig(tuple(honest), seed, settings), decoy)
