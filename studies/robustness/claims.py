"""Claims that are tested in every setting: claims of the simulations and headlines of the README."""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from affordance.experiments import com, hammer, reach, weight
from affordance.reporting.claims import ClaimResult, check, claim, confirm

EXPERIMENTS = ("weight", "com", "reach", "hammer")
TASKS = "tasks"  # key of results about both reaching and hammering


class _Undefined(dict[str, Any]):
    """Undefined results of an experiment that was not run, with the shapes that claims expect."""

    def __missing__(self, key: str) -> Any:
        return math.nan if key in _SCALARS else np.full((7, 2) if key.endswith("_ci95") else 7, math.nan)


_SCALARS = (
    *("density_true", "decoy_lift_m", "decoy_rises", "mass_error", "com_error_m", "inertia_error"),
    *("energy_ratio_true", "travel_of_other_grip_m"),
)
_NAMES = ("correct_grip", "grip_of_densest", "grip_of_densest_far", "correct_reach", "correct_hammer")
_UNDEFINED = _Undefined(dict.fromkeys(_NAMES, ""), effort_differs=False)


def judge(numbers: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Tests all claims, given the results of each experiment that could be run.

    Returns: 1 if a claim holds, 0 if it does not, NaN if it cannot be tested.
    """
    outcomes = {
        name: float(each.met) if numbers.get(name.split(".")[0]) else math.nan
        for name, each in _judge_all(numbers).items()
    }
    if numbers.get("hammer", {}).get("force_ratios") is None:
        outcomes["hammer.sufficient_force"] = math.nan
    return outcomes


@cache
def list_claims() -> Mapping[str, ClaimResult]:
    """Lists all claims without testing them, by experiment and key, for example ``weight.drop_reduced``."""
    return _judge_all({})


def _judge_all(numbers: Mapping[str, Mapping[str, Any]]) -> dict[str, ClaimResult]:
    """Tests the claims of the simulations and the headlines."""
    known = {name: numbers.get(name) or _UNDEFINED for name in (*EXPERIMENTS, TASKS)}
    if known["hammer"]["force_ratios"] is None:
        known["hammer"] = {**known["hammer"], "force_ratios": []}
    of_simulations = {
        "weight": weight.judge(known["weight"]),
        "com": com.judge(known["com"]),
        "reach": reach.judge(known["reach"], known["reach"]["grip_of_densest"]),
        "hammer": hammer.judge(known["hammer"], known["hammer"]["grip_of_densest_far"]),
    }
    judged = (*of_simulations.items(), *_judge_headlines(known).items())
    return {f"{name}.{each.key}": each for name, claims in judged for each in claims}


def _judge_headlines(numbers: Mapping[str, Mapping[str, Any]]) -> dict[str, list[ClaimResult]]:
    """Tests statements of the README that are not among the claims of the simulations."""
    by_reach, by_hammer, tasks = (numbers[name] for name in ("reach", "hammer", TASKS))
    ci95 = by_reach["p_correct_ci95"]
    return {
        "reach": [
            claim("after_one", "README", "After one trial 65 % of the choices are correct (reaching).",
                  check("lower end of the 95 % interval, which must contain 65 %", ci95[1][0], at_most=0.65),
                  check("upper end of this interval", ci95[1][1], at_least=0.65)),
            claim("after_two", "README", "After two trials every choice is correct (reaching).",
                  check("upper end of the 95 % interval of correct choices after two trials",
                        ci95[2][1], at_least=0.999999999)),
        ],
        "hammer": [
            claim("learned", "README", "After the last trial at least 95 of 100 choices are correct (hammering).",
                  check("correct after the last trial", by_hammer["p_correct"][-1], at_least=0.95)),
            claim("light_taps", "README",
                  "Only for taps that move the nail by less than half a millimetre is the steel end cheaper.",
                  check("largest travel at which the other grip is cheaper (m)",
                        by_hammer["travel_of_other_grip_m"], at_most=0.0005)),
        ],
        TASKS: [
            claim("opposite_grips", "README", "Reaching and hammering ask for opposite grips of one tool.",
                  confirm("correct grips differ", tasks["correct_reach"] != tasks["correct_hammer"])),
            claim("work_measures_agree", "README",
                  "Absolute, positive and muscular work choose the same grip, in both tasks.",
                  confirm("each measure chooses the grip of absolute work", all(tasks["work_measures_agree"]))),
            claim("effort_differs", "README", "Effort chooses another grip than absolute work for hammering.",
                  confirm("the chosen grips differ", tasks["effort_differs"])),
        ],
    }  # fmt: skip
