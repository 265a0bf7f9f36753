import dataclasses
from types import SimpleNamespace

import pytest
from helpers.two_tools import STICK

from affordance.exceptions import BadValueError
from affordance.experiments.shared.correct_grip import (
    check_one_grip_is_cheaper,
    find_cheaper_grip,
    find_grip_of_densest,
    remove_errors,
)
from affordance.files.model_folder import MODELS
from affordance.proprioception.faults import Faults
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import FeatureSource, VisionError


def test_cheaper_grip_is_that_of_least_work():
    simulated = {"wood": SimpleNamespace(work=2.0), "steel": SimpleNamespace(work=1.5)}
    assert find_cheaper_grip(simulated) == "steel"


@pytest.mark.parametrize("works", [(8.0, 8.0), (8.0, 8.0 * (1.0 + 1e-10))])
def test_tool_without_a_cheaper_grip_is_rejected(works):
    with pytest.raises(
        BadValueError, match=r"novel.yaml: tools: stick: costs 8 J in both grips, must have a cheaper"
    ):
        check_one_grip_is_cheaper(MODELS / "tools" / "novel.yaml", STICK, works)


def test_of_more_than_two_grips_the_two_cheapest_must_differ():
    path = MODELS / "tools" / "novel.yaml"
    check_one_grip_is_cheaper(path, STICK, (9.0, 8.0, 9.0))
    with pytest.raises(BadValueError, match=r"stick: costs 8 J in two of its 3 grips, must have a cheaper one$"):
        check_one_grip_is_cheaper(path, STICK, (8.0, 9.0, 8.0))
    check_one_grip_is_cheaper(MODELS / "tools" / "novel.yaml", STICK, (8.0, 8.001))


def test_heavy_end_is_found_by_its_material_not_by_its_name():
    assert find_grip_of_densest(STICK, at_hand=True) == "steel"
    assert find_grip_of_densest(STICK, at_hand=False) == "wood"
    swapped = [
        dataclasses.replace(grip, name=name) for grip, name in zip(STICK.grips, ("left", "right"), strict=True)
    ]
    assert find_grip_of_densest(dataclasses.replace(STICK, grips=tuple(swapped)), at_hand=True) == "right"


def test_nothing_is_mistaken_where_errors_are_removed():
    mistaken = dataclasses.replace(
        DEFAULT_SETTINGS,
        feature_source=FeatureSource.PIXELS,
        vision_error=VisionError(size=0.1),
        faults=Faults(arm_mass_factor=1.05),
    )
    assert remove_errors(mistaken) == DEFAULT_SETTINGS
