"""Simulation I (paper, IV-A): the weight of rods, after Mounoud & Bower (1974).

Four objects of one material, presented from short to long, then a decoy that looks like the last and weighs far less.
Each is put into the outstretched hand and held; the measured torques update the belief about the material before the
next object is observed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.belief.learners import start_memory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError
from affordance.experiments.definition import OBSERVER_SHOWN, Arrays, Outputs
from affordance.experiments.shared.checks import check_tools_can_be_held, check_tools_have_one_grip
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.trajectories import count_events, label_heights, label_motions, stack_heights
from affordance.experiments.within_trial import WHITE, WithinTrialStudy
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.objects.colour import Colour
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Tool
from affordance.random_streams import Stream
from affordance.reporting import figures, statistics
from affordance.reporting.replay import Scene, write_replay
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.diagram import OUTLIER_P_VALUE
from affordance.simulation.trial import Observer, TrialRecord, get_runner

QUARTILES = (0.25, 0.5, 0.75)


@dataclass(frozen=True)
class Weight:
    """Simulation I.

    Attributes:
        tools: The honest objects in order of presentation, then the decoy.
        seed: Root of every random draw.
        settings: What all simulations share.
        duration: How long each object is held, [s].
    """

    tools: tuple[Tool, ...]
    seed: int = 0
    settings: Settings = DEFAULT_SETTINGS
    duration: float = 3.0

    name = "weight"
    unit = "observer"
    section = Path(__file__).parent / "sections" / "weight.yaml"

    @property
    def colour(self) -> Colour:
        """That of all the objects."""
        return self.tools[0].components[0].looks_like.colour

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """All objects."""
        return self.tools

    def with_settings(self, settings: Settings) -> "Weight":
        """Returns the experiment with other settings."""
        return replace(self, settings=settings)

    def count_repeats(self, observers: int) -> int:
        """One repeat an observer."""
        return observers

    def plan(self, jobs: int) -> None:
        """Nothing is shared."""

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> None:
        """None is needed."""

    def select_shared(self, plan: None) -> None:
        """Nothing is shared."""

    def run_trials(self, repeat: int) -> tuple[list[TrialRecord], list[Memory]]:
        """Runs one observer through all trials; returns their records, and the memories before and after each."""
        start = start_memory(self.settings.learner, (self.seed, repeat, Stream.KINDS))
        memory = start.add_colours([self.colour], self.settings.prior)
        observer = Observer(get_runner(self.settings), memory, duration=self.duration)
        records: list[TrialRecord] = []
        memories: list[Memory] = [memory]
        for trial, tool in enumerate(self.tools):
            records.append(observer.hold(tool, (self.seed, repeat, trial)))
            memories.append(observer.memory)
        return records, memories

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer.

        Returns: Arrays over the K trials: ``times`` (N,), heights (K, N), ``log_evidence`` and counts (K,); and over
            the K + 1 moments between them, ``density_quartiles`` (K + 1, 3) and ``density_mode`` (K + 1,).
        """
        records, memories = self.run_trials(repeat)
        return {
            **stack_heights(records),
            "density_quartiles": np.stack(
                [memory.belief.compute_percentiles(QUARTILES)[:, 0] for memory in memories]
            ),
            "density_mode": np.array([memory.belief.compute_mode()[0] for memory in memories]),
            "log_evidence": np.array([record.log_evidence for record in records]),
            **count_events(records),
        }

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        num_honest = len(self.tools) - 1
        quartiles = np.median(arrays["density_quartiles"][:, : num_honest + 1], axis=0)
        height = arrays["height_centre"]
        drops = statistics.compute_drop(height[:, :num_honest])
        drop = statistics.estimate_mean(drops)
        growth = statistics.estimate_mean(np.diff(drops, axis=1))
        lift = statistics.estimate_mean(statistics.compute_lift(height[:, -1]))
        excursion = statistics.compute_excursion(height)
        decoy = self.tools[-1]
        return {
            "density_true": self.tools[0].components[0].material.density,
            "density_p25": quartiles[:, 0],
            "density_median": quartiles[:, 1],
            "density_p75": quartiles[:, 2],
            "density_mode": np.median(arrays["density_mode"][:, : num_honest + 1], axis=0),
            "drop_m": drop.mean,
            "drop_m_ci95": drop.ci95,
            "drop_growth_m": growth.mean,
            "drop_growth_m_ci95": growth.ci95,
            "deviation_m": np.abs(excursion[:, :num_honest]).mean(axis=0),
            "mass_true": [tool.mass for tool in self.tools[:-1]],
            "decoy_mass_true": decoy.mass,
            "decoy_lift_m": lift.mean,
            "decoy_lift_m_ci95": lift.ci95,
            "decoy_rises": (excursion[:, -1] > 0.0).mean(),
            "decoy_density_true": decoy.components[0].material.density,
            "log_evidence": arrays["log_evidence"].mean(axis=0),
            "periods_limited": arrays["periods_limited"].sum(axis=0),
            "periods_failed": arrays["periods_failed"].sum(axis=0),
            "samples_rejected": arrays["rejected"].sum(axis=0),
            "trials_outlier": (arrays["p_value"] < OUTLIER_P_VALUE).sum(axis=0),
        }

    def study_within_trial(self) -> WithinTrialStudy:
        """What happens within the first trial of the observer that is shown."""
        seed = (self.seed, OBSERVER_SHOWN, 0)
        return WithinTrialStudy(self.settings, self.tools[0], duration=self.duration, seed=seed)

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """What is presented, in words."""
        *_, longest, decoy = self.tools
        materials = " and ".join(dict.fromkeys(part.material.name for part in decoy.components))
        looks_like = decoy.components[0].looks_like.name
        return {
            "duration": self.duration,
            "names": [tool.name for tool in self.tools],
            "material": self.tools[0].components[0].material.name,
            "decoy_looks_like": "the last one" if decoy.appearance == longest.appearance else looks_like,
            "decoy_materials": materials,
            "run_shown": OBSERVER_SHOWN,
            "white_sd": WHITE.sd,
        }

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Figures 3 and 4, trajectories, Diagram and replay."""
        records, _ = self.run_trials(OBSERVER_SHOWN)
        trial = get_runner(self.settings).get_diagram(self.duration)
        within = self.study_within_trial()
        quartiles = LabelledArray(
            ("repeat", "moment", "percentile"),
            arrays["density_quartiles"],
            "kg/m^3",
            "percentile of the believed density, before the first and after each trial",
        )
        percentiles = LabelledArray(("percentile",), 100.0 * np.array(QUARTILES), "%", "percentile")
        scenes = [
            Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg")
            for tool, record in zip(self.tools, records, strict=True)
        ]
        return Outputs(
            figures={
                "figure3": partial(self._draw_density, arrays),
                "figure4": partial(self._draw_heights, arrays),
                "posterior": within.draw_growth,
                "sinking": within.draw_sinking,
            },
            trajectories=Trajectories(
                {
                    **label_heights(arrays),
                    "density": quartiles,
                    "percentile": percentiles,
                    **label_motions(records, f"observer {OBSERVER_SHOWN}"),
                },
                {"trial": [tool.name for tool in self.tools], "joint": trial.arm.joint_names},
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_replay(
                path, self.settings.arm, scenes, title=f"Simulation I, seed {self.seed}"
            ),
            writers={"within_trial": lambda folder: write_json(folder / "within_trial.json", within.summarise())},
        )

    def _draw_density(self, arrays: Arrays) -> Figure:
        height, num_honest = arrays["height_centre"], len(self.tools) - 1
        return figures.draw_density_and_drop(
            quartiles=np.median(arrays["density_quartiles"][:, : num_honest + 1], axis=0),
            mode=np.median(arrays["density_mode"][:, : num_honest + 1], axis=0),
            density_true=self.tools[0].components[0].material.density,
            drop=statistics.estimate_mean(statistics.compute_drop(height[:, :num_honest])),
            masses=np.array([tool.mass for tool in self.tools[:-1]]),
            num_repeats=len(height),
        )

    def _draw_heights(self, arrays: Arrays) -> Figure:
        height = arrays["height_centre"]
        return figures.draw_heights(
            times=arrays["times"][0],
            shown=height[OBSERVER_SHOWN],
            mean=statistics.estimate_mean(height),
            labels=[tool.name for tool in self.tools],
            shown_label=f"seed {self.seed}, observer {OBSERVER_SHOWN}",
            num_repeats=len(height),
        )


def load(models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS) -> Weight:
    """Reads the objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    path = models / "tools" / "weight.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) < 3:
        raise BadValueError(
            path, "tools", f"has {len(tools)} entries, must have at least 3: two objects and the decoy"
        )
    check_tools_have_one_grip(path, tools)
    shown = {component.looks_like for tool in tools for component in tool.components}
    if len(shown) > 1:
        names = ", ".join(sorted(material.name for material in shown))
        raise BadValueError(path, "tools", f"look like {names}, must all look like one material")
    honest = {component.material for tool in tools[:-1] for component in tool.components}
    if honest != shown:
        names = ", ".join(sorted(material.name for material in honest))
        raise BadValueError(path, "tools", f"before the decoy are made of {names}, must be of the one they look like")
    (material,) = shown
    decoy = tools[-1]
    density = decoy.mass / sum(component.shape.volume for component in decoy.components)
    if density >= material.density * (1.0 - 1e-9):  # equal, but for rounding, is not less
        problem = (
            f"has a density of {density:g} kg/m^3, must be less than the {material.density:g} of {material.name}"
        )
        raise BadValueError(path, f"tools: {decoy.name}", f"{problem}, which it looks like")
    check_tools_can_be_held(path, tools, settings)
    return Weight(tools, seed, settings)
