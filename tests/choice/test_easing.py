"""Advice on infeasible tasks: the reason, and less weight or an easier task that would make them feasible."""

import numpy as np
import pytest
from helpers.one_option import FAR, KNOWN, SETTINGS, list_one

from affordance.choice.carry import Carry
from affordance.choice.demand import Criterion
from affordance.choice.keep import Keep
from affordance.choice.pricing import GripBounds
from affordance.choice.reach import Reach
from affordance.choice.weighing import weigh
from affordance.exceptions import AffordanceError


@pytest.mark.parametrize("task", [Reach(FAR), Carry(FAR)])
def test_path_beyond_reach_says_where_by_how_much_and_what_could_be_done(task: Reach | Carry) -> None:
    advice = weigh(list_one(), task, KNOWN, SETTINGS, num_samples=50, rng=np.random.default_rng(0))
    with pytest.raises(AffordanceError) as caught:
        _ = advice.best
    said = str(caught.value)
    assert "leaves the path by 0." in said
    assert " m, must stay within 0.02 m: near point " in said
    assert ", where " in said
    assert said.endswith(" it could")
    assert "; 0." in said or "; mirrored" in said or "times slower" in said


def test_tool_that_is_too_heavy_could_be_lighter() -> None:
    held = {"options": list_one(), "task": Keep(1.0), "memory": KNOWN, "settings": SETTINGS}
    weight = weigh(**held, criterion=Criterion.GRIP, num_samples=50, rng=np.random.default_rng(0)).best.force.mean
    bounds = GripBounds(force=0.5 * weight)
    advice = weigh(**held, bounds=bounds, num_samples=50, rng=np.random.default_rng(0))
    with pytest.raises(AffordanceError, match=r"with 0\.(49|48|47|46) times its weight it could$"):
        _ = advice.best
