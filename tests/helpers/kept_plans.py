"""Motions are planned once in a run of the tests: results are kept by their arguments for all processes."""

import functools
import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from affordance.choice import hammer, reach
from affordance.control import swing
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.exceptions import AffordanceError
from affordance.plant.arm import Arm
from affordance.plant.chain_plant import build_chain

# Functions that a test may replace; nothing is kept then.
_SOLVERS = (MinimumAccelerationMpc.solve, swing._solve)


@contextmanager
def keep_plans(folder: Path) -> Iterator[None]:
    """Lets tasks plan their swings and motions once, for all processes that share a folder."""
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((hammer, "plan_swing"), (reach, "plan_motion")):
            patch.setattr(module, name, _keep(getattr(module, name), folder))
        yield


def _keep(plan: Callable[..., Any], folder: Path) -> Callable[..., Any]:
    failed: dict[str, AffordanceError] = {}

    @functools.wraps(plan)
    def plan_once(model: Any, *arguments: Any, **words: Any) -> Any:
        if (MinimumAccelerationMpc.solve, swing._solve) != _SOLVERS:
            return plan(model, *arguments, **words)
        content = (plan.__name__, _describe(model.arm), arguments, words)
        key = hashlib.sha256(pickle.dumps(content)).hexdigest()
        path = folder / f"{key}.pickle"
        if key in failed:
            raise failed[key]
        if path.exists():
            return pickle.loads(path.read_bytes())
        try:
            found = plan(model, *arguments, **words)
        except AffordanceError as error:
            failed[key] = error
            raise
        other = path.with_suffix(f".{os.getpid()}")
        other.write_bytes(pickle.dumps(found))
        other.rename(path)
        return found

    return plan_once


@functools.lru_cache(maxsize=64)
def _describe(arm: Arm) -> bytes:
    """Describes all that motions depend on: kinematics, limits and home."""
    return pickle.dumps((replace(build_chain(arm), source=""), *arm.limits, arm.home))
