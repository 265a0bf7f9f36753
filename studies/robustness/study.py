"""Robustness study: tests of all claims for a sample of settings, one setting per repeat."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import Array, Arrays
from affordance.files.atomic import write_text
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.reporting.statistics import Estimate
from affordance.settings import DEFAULT_SETTINGS, Settings
from studies.robustness.assumptions import Assumption, list_defaults, load_assumptions, sample_places, sample_settings
from studies.robustness.choosing import MOMENTS
from studies.robustness.claims import EXPERIMENTS, TASKS, list_claims
from studies.robustness.effects import Effects, find_levels, measure_effects, name_levels, share_by_level
from studies.robustness.evaluate import PARTS, Outcome, evaluate_setting
from studies.robustness.figure import draw_multiverse
from studies.robustness.interpolation import TOLERANCE

_NONE = "none above chance"
_CHOOSING = ("reach", "hammer")
# Reasons why an experiment could not be run, by a phrase in the error message.
_KINDS = {
    "worst direction": "the path comes too near rank loss",
    "leaves the path": "the controller leaves the path",
    "no plan": "the controller finds no plan",
    "no swing of": "no swing within the joints' limits strikes",
    "tip speed": "no swing is fast enough",
    "no grip can do it": "no grip can do it within the joints' limits",
    "does not converge": "the search for least work does not converge",
    "puts ": "the arm cannot take the start posture",
    "must be at most": "an object is too heavy to hold",
}
# Number of observers per setting, as in the simulations.
DEFAULT_NUM_OBSERVERS = 200
# Default number of settings, with which fractions have errors of at most 6 %.
DEFAULT_NUM_SETTINGS = 300
# Contact is simulated in one of this many settings, which takes a tenth of the total time.
CONTACT_EVERY = 3
# Interpolation is validated in the default setting and in one of this many settings.
PROVE_EVERY = 60
# Largest error of interpolated trajectories, [m].
INTERPOLATION_BOUND = TOLERANCE


@dataclass(frozen=True)
class Robustness:
    """Configuration of the robustness study."""

    assumptions: tuple[Assumption, ...]  # varied assumptions
    models: Path = MODELS  # folder of materials, path, nail and arm
    seed: int = 0  # root seed
    settings: Settings = DEFAULT_SETTINGS  # default settings of the simulations
    num_observers: int = DEFAULT_NUM_OBSERVERS  # number of observers per setting

    def list_files(self) -> list[Path]:
        """Lists all model files: files of the arm, and materials, path and nail, which settings modify."""
        names = ("materials.yaml", "paths/reach.yaml", "nail.yaml")
        return [*list_arm_files(self.settings.arm), *(self.models / name for name in names)]

    def evaluate(self, index: int | None, *, proves: bool = False) -> tuple[dict[str, float | str], Outcome]:
        """Evaluates a setting with its own random seed.

        Args:
            index: Index of a sampled setting; None for the default setting.
            proves: True to simulate all holds and compare them with interpolated trajectories.

        Returns: Values of the assumptions, and the outcome.
        """
        if index is None:
            setting, seed = list_defaults(self.assumptions), self.seed
        else:
            setting = sample_settings(self.assumptions, index + 1, self.seed)[index]
            seed = int(np.random.SeedSequence([self.seed, index]).generate_state(1)[0])
        outcome = evaluate_setting(
            setting,
            seed=seed,
            models=self.models,
            settings=self.settings,
            num_observers=self.num_observers,
            simulates_contact=index is None or index % CONTACT_EVERY == 0,
            proves=proves,
        )
        return setting, outcome

    def run_setting(self, repeat: int) -> Arrays:
        """Evaluates the default setting (repeat 0) or a sampled setting.

        Returns: ``outcomes``, (C,), which are 1, 0 or NaN; ``p_correct``, (2, 4), and ``work_ratio``, (2,), for
            reaching and hammering; ``reasons``, (5,), why experiments could not be run; ``simulated``, fraction of
            simulated holds; ``interpolation_error``, NaN if not measured; ``cpu_s``, (8,).
        """
        _, outcome = self.evaluate(repeat - 1 if repeat else None, proves=repeat == 0 or repeat % PROVE_EVERY == 1)
        chosen = [outcome.numbers.get(name, {}) for name in _CHOOSING]
        nothing = np.full(len(MOMENTS), np.nan)
        return {
            "outcomes": np.array(list(outcome.outcomes.values())),
            "p_correct": np.array([numbers.get("p_correct", nothing) for numbers in chosen]),
            "work_ratio": np.array([numbers.get("energy_ratio_true", np.nan) for numbers in chosen]),
            "reasons": np.array(list(outcome.reasons.values()), dtype="U300"),
            "simulated": np.array(outcome.simulated),
            "interpolation_error": np.array(outcome.interpolation_error),
            "cpu_s": np.array([outcome.cpu_s[part] for part in PARTS]),
        }

    def compute_metrics(self, arrays: Arrays) -> dict[str, Any]:
        """Computes the content of metrics.json."""
        known = list_claims()
        default = np.asarray(arrays["outcomes"][0], dtype=float)
        errors = np.asarray(arrays["interpolation_error"], dtype=float)
        proven = np.isfinite(errors)
        arrays = _drop_default(arrays)
        outcomes = np.asarray(arrays["outcomes"], dtype=float)
        count = len(outcomes)
        levels = find_levels(self.assumptions, sample_places(len(self.assumptions), count, self.seed))
        claims = {}
        for column, (name, claim) in enumerate(known.items()):
            effects = measure_effects(outcomes[:, column], levels, self.seed)
            claims[name] = {
                "text": claim.text,
                "source": claim.source,
                **self._describe(effects, outcomes[:, column], levels),
                "fails_in": np.flatnonzero(outcomes[:, column] == 0.0),
            }
        reasons = arrays["reasons"]
        places = dict(zip((*EXPERIMENTS, TASKS), reasons.T, strict=True))
        return {
            "settings": count,
            "observers": self.num_observers,
            "default_meets": [name for name, outcome in zip(known, default, strict=True) if outcome == 1.0],
            "default_fails": [name for name, outcome in zip(known, default, strict=True) if outcome == 0.0],
            "simulated": float(np.mean(arrays["simulated"] == 1.0)),
            "interpolation_proven": bool(proven.any() and (errors[proven] <= INTERPOLATION_BOUND).all()),
            "interpolation_bound_m": INTERPOLATION_BOUND,
            "interpolation_error_m": float(errors[proven].max()) if proven.any() else None,
            "proven_in": np.flatnonzero(proven[1:]),
            "claims": claims,
            "p_correct": {
                name: self._describe_choices(arrays["p_correct"][:, task], levels)
                for task, name in enumerate(_CHOOSING)
            },
            "not_run": {name: int((column != "").sum()) for name, column in places.items()},
            "reasons": {name: _count_reasons(column) for name, column in places.items()},
            "not_converged": int(sum("does not converge" in reason for reason in places["hammer"])),
            "cpu_s": dict(zip(PARTS, arrays["cpu_s"].mean(axis=0), strict=True)),
            "first_order": {name: each["first_order"] for name, each in claims.items()},
        }

    def _describe(self, effects: Effects, outcomes: Array, levels: NDArray[np.intp]) -> dict[str, Any]:
        strongest = self.assumptions[effects.strongest]
        by_level = share_by_level(outcomes, levels[:, effects.strongest], name_levels(strongest))
        found = effects.is_above_chance
        return {
            "holds": effects.holds if effects.evaluated else None,
            "ci95": effects.ci95,
            "evaluated": effects.evaluated,
            "strongest_assumption": strongest.name if found else _NONE,
            "strongest_index": float(effects.indices.max()),
            "null_level": effects.null_level,
            "holds_by_level": by_level if found else {},
            "first_order": {
                each.name: float(index) for each, index in zip(self.assumptions, effects.indices, strict=True)
            },
        }

    def _describe_choices(self, p_correct: Array, levels: NDArray[np.intp]) -> dict[str, Any]:
        """Computes quantiles of the probability of correct choices, (N, moments), overall and by noise structure."""
        (column,) = (place for place, each in enumerate(self.assumptions) if each.name == "noise_structure")
        structures = self.assumptions[column].choices
        chosen = {name: levels[:, column] == level for level, name in enumerate(structures)}
        return {
            name: _list_quantiles(p_correct[rows & np.isfinite(p_correct[:, 0])])
            for name, rows in {"all": np.ones(len(levels), dtype=bool), **chosen}.items()
        }

    def draw(self, numbers: Mapping[str, Any]) -> Figure:
        """Plots fractions and sensitivity indices for all claims."""
        order = (*EXPERIMENTS, TASKS)
        claims = dict(sorted(numbers["claims"].items(), key=lambda entry: order.index(entry[0].split(".")[0])))
        shares = np.array([[each["holds"] or 0.0, *each["ci95"]] for each in claims.values()])
        return draw_multiverse(
            [name.replace("_", " ").replace(".", ": ") for name in claims],
            [each.label for each in self.assumptions],
            shares=Estimate(*shares.T),
            indices=np.array([list(each["first_order"].values()) for each in claims.values()]),
            null_levels=np.array([each["null_level"] for each in claims.values()]),
        )

    def write_settings(self, arrays: Arrays, folder: Path) -> None:
        """Writes a table of the sample, with one row per setting, to a folder."""
        arrays = _drop_default(arrays)
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        measured = [f"{name}.p_correct[{moment}]" for name in _CHOOSING for moment in MOMENTS]
        measured += [f"{name}.energy_ratio_true" for name in _CHOOSING]
        names = [each.name for each in self.assumptions]
        writer.writerow(["setting", *names, *list_claims(), *measured, "not run"])
        settings = sample_settings(self.assumptions, len(arrays["outcomes"]), self.seed)
        columns = (arrays[name] for name in ("outcomes", "p_correct", "work_ratio", "reasons"))
        for index, (setting, row, p_correct, ratios, reasons) in enumerate(zip(settings, *columns, strict=True)):
            values = [f"{value:.6g}" if isinstance(value, float) else value for value in setting.values()]
            # Cells are blank if a claim was not tested.
            held = ["" if np.isnan(outcome) else int(outcome) for outcome in row]
            shown = ["" if np.isnan(number) else f"{number:.6g}" for number in (*p_correct.ravel(), *ratios)]
            writer.writerow([index, *values, *held, *shown, "; ".join(str(reason) for reason in reasons if reason)])
        write_text(folder / "settings.csv", text.getvalue())


def _drop_default(arrays: Arrays) -> Arrays:
    return {name: array[1:] for name, array in arrays.items()}


def _list_quantiles(values: Array) -> dict[str, Any]:
    """Computes the number of rows and, if there are any, 5, 50 and 95 % quantiles."""
    if not len(values):
        return {"count": 0}
    low, median, high = np.quantile(values, [0.05, 0.5, 0.95], axis=0)
    return {"count": len(values), "p05": low, "median": median, "p95": high}


def _count_reasons(reasons: Sequence[str]) -> dict[str, int]:
    given = [str(reason) for reason in reasons if reason]
    kinds = (next((words for part, words in _KINDS.items() if part in reason), reason) for reason in given)
    return dict(Counter(kinds).most_common())


def load(models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS) -> Robustness:
    """Loads the assumptions, and configures the study."""
    return Robustness(load_assumptions(), models, seed, settings)
