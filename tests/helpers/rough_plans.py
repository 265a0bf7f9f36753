"""Plans of choices for tests that do not need changes of costs by parts that are moved a little."""

import pytest

from affordance.choice import off_axis
from affordance.experiments.shared.choice_task import ChoicePlan
from affordance.experiments.shared.choosing import ChoiceExperiment


def plan_roughly(experiment: ChoiceExperiment) -> ChoicePlan:
    """Plans with parts of each tool moved in two ways only; ``choice/test_off_axis.py`` tries all of them."""
    every = off_axis.list_shifted
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(off_axis, "list_shifted", lambda tool: [*every(tool)][:2])
        return experiment.plan(jobs=1)
