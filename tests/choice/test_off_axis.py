"""Change of a task's work if parts of the tool are displaced."""

import numpy as np
import pytest
from helpers.two_tools import HAMMER, REACH, STICK

from affordance.choice.off_axis import SHIFT, list_shifted, measure_change, measure_changes
from affordance.exceptions import AffordanceError
from affordance.experiments import reach
from affordance.settings import DEFAULT_SETTINGS


def test_each_part_is_moved_along_each_axis_both_ways():
    moved = list(list_shifted(STICK))
    assert len(moved) == 12
    steps = []
    for tool in moved:
        before, after = (np.array([part.X_TE for part in each.components]) for each in (STICK, tool))
        steps.append(tuple((after - before)[:, :3, 3].ravel()))
        np.testing.assert_array_equal(after[:, :3, :3], before[:, :3, :3])
    assert len(np.unique(np.round(steps, 9), axis=0)) == 12
    np.testing.assert_allclose(np.abs(steps).sum(axis=1), SHIFT)


def compute_place(held):
    return float(held.components[1].X_TE[0, 3])


def test_change_is_the_largest_relative_one():
    """A work that is the distance from the wooden grip to the second part, 225 mm, changes by 2 mm / 225 mm."""
    assert measure_change(compute_place, STICK, STICK.grips[0]) == pytest.approx(0.002 / 0.225)
    changes = measure_changes(compute_place, [STICK, HAMMER], jobs=1, description="test")
    assert list(changes) == ["stick", "hammer"]
    # Seen from the steel end the second part is at 75 mm, of which its displacement is 2 mm.
    assert changes["stick"] == pytest.approx(0.002 / 0.075)


def test_reaching_from_its_start_hardly_depends_on_where_parts_sit():
    """Displaced parts change the work of reaching with the stick by its steel end by less than 3 %."""
    grip = STICK.grips[1]
    changed = [tool for k, tool in enumerate(list_shifted(STICK)) if k in (2, 4, 8, 10)]
    works = [reach.compute_work(REACH, DEFAULT_SETTINGS, tool.gripped_by(grip)) for tool in (STICK, *changed)]
    assert 0.0 < np.abs(np.array(works[1:]) / works[0] - 1.0).max() < 0.03


def test_tools_with_which_a_task_at_its_limit_cannot_be_done_do_not_count():
    """Displacements for which no swing is fast enough are left out; the others give a change of 2 mm / 225 mm."""
    grip = STICK.grips[0]
    limit = compute_place(STICK.gripped_by(grip))

    def compute_work(held):
        if compute_place(held) > limit + 1e-9:
            raise AffordanceError("no swing is so fast")
        return compute_place(held)

    assert measure_change(compute_work, STICK, grip) == pytest.approx(0.002 / 0.225)


def test_task_that_cannot_be_done_with_the_tool_as_it_is_has_no_change():
    def refuse(held):
        raise AffordanceError("no swing is so fast")

    with pytest.raises(AffordanceError, match="so fast"):
        measure_change(refuse, STICK, STICK.grips[0])
