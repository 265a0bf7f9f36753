"""Objects of an experiment are made of the materials of the folder that they are read from."""

import dataclasses

import pytest
from helpers.changed_files import change_file

from affordance.experiments import com, hammer, reach, weight
from affordance.experiments.shared.observers import Setup
from affordance.extensions.pixels.experiments import vision


def list_tools(found):
    """All tools of what an experiment reads."""
    if hasattr(found, "components"):
        return [found]
    return [tool for each in found for tool in list_tools(each)] if isinstance(found, tuple | list) else []


@pytest.mark.parametrize(
    ("module", "material", "density"),
    [
        (weight, "brass", 8500),
        (com, "beech", 720),
        (reach, "steel", 7850),
        (hammer, "steel", 7850),
        (vision, "beech", 720),
    ],
)
def test_objects_are_made_of_the_materials_of_their_folder(models, module, material, density):
    change_file(models / "materials.yaml", f"density: {density}", f"density: {density - 10}")
    setup = dataclasses.replace(Setup(), models=models)
    found = {
        part.material.density
        for tool in list_tools(module.read(setup))
        for part in tool.components
        if part.material.name == material
    }
    assert found == {density - 10}
