"""Small runs of the study of active choice: one task, few observers; as shipped and with one thing changed."""

import functools
from typing import Any

import numpy as np
import pytest

from helpers.counter_runs import Numbers
from studies.active import study

TASKS = ("reach",)
_RULES = ("value", "information", "random")
_IRRELEVANT = ("rod of alloy_steel", "rod of ductile_iron", "rod of aluminium", "rod of steel")


@functools.cache
def choose_actively(*, is_perverse: bool = False) -> Numbers:
    """Returns the numbers of the study; if perverse, what is said to be worth most is of materials of no tool."""
    return study.describe_rules({rule: _live(rule, is_perverse and rule == "value") for rule in _RULES})


@functools.cache
def _live(rule: str, is_perverse: bool) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        if is_perverse:
            patch.setitem(
                study.RULES,  # type: ignore[arg-type]
                "value",
                lambda workshop, memory, left, rng: next((n for n in left if n in _IRRELEVANT), left[0]),
            )
        config = study.ActiveConfig(rule, tasks=TASKS, horizon=4)
        lived = [study.run_observer(config, repeat) for repeat in range(4)]
    return {name: np.stack([each[name] for each in lived]) for name in lived[0]}


def time_advice(num_samples: int = 4000) -> Numbers:
    """Returns the time of an advice by so many samples."""
    study.time_advice(TASKS, 200)  # what is built once is not timed
    return {"ms_per_candidate": study.time_advice(TASKS, num_samples)}
