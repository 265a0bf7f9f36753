"""Symmetry of a tool, by which shape alone does not tell its grips apart."""

import dataclasses

import numpy as np
import pytest

from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.objects.load import load_tools
from affordance.objects.tool import is_symmetric

STICK, *OTHERS = load_tools(MODELS / "tools" / "novel.yaml")


def test_of_the_novel_tools_the_stick_alone_is_symmetric():
    assert is_symmetric(STICK)
    assert [tool.name for tool in OTHERS if is_symmetric(tool)] == []


def change_part(tool, index, **changes):
    parts = list(tool.components)
    parts[index] = dataclasses.replace(parts[index], **changes)
    return dataclasses.replace(tool, components=tuple(parts))


@pytest.mark.parametrize(
    "change",
    [
        {"shape": Ellipsoid((0.075, 0.015, 0.0151))},
        {"X_TE": np.array([[1.0, 0, 0, 0.226], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])},
    ],
)
def test_a_part_that_is_another_spoils_it(change):
    assert not is_symmetric(change_part(STICK, 1, **change))


def test_material_does_not_count_and_one_grip_is_no_choice():
    assert is_symmetric(STICK.with_densities({part.looks_like.colour: 9000.0 for part in STICK.components}))
    assert not is_symmetric(dataclasses.replace(STICK, grips=STICK.grips[:1]))
