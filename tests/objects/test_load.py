import itertools

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS
from affordance.objects.colour import is_same_colour
from affordance.objects.load import list_materials, load_tools
from affordance.objects.materials import load_materials

GOOD_MATERIALS = """
brass: {colour: "#b5a642", density: 8500, density_sd: 87, source: a table}
beech: {colour: "#c98f5a", density: 720, density_sd: 72, source: a book}
"""
GOOD_TOOLS = """
tools:
  - name: hammer
    components:
      - {semi_axes: [0.1, 0.01, 0.01], position: [0.1, 0, 0], material: beech}
      - semi_axes: [0.02, 0.05, 0.02]
        position: [0.2, 0, 0]
        rpy_deg: [0, 0, 90]
        material: beech
        looks_like: brass
"""


@pytest.fixture
def files(tmp_path):
    def write(materials=GOOD_MATERIALS, tools=GOOD_TOOLS):
        (tmp_path / "materials.yaml").write_text(materials, encoding="utf-8")
        (tmp_path / "tools.yaml").write_text(tools, encoding="utf-8")
        return load_tools(tmp_path / "tools.yaml", load_materials(tmp_path / "materials.yaml"))

    return write


TOOL_FILES = sorted((MODELS / "tools").glob("*.yaml")) + [
    MODELS / "workshop" / name for name in ("tools.yaml", "blanks.yaml", "uncommon.yaml")
]


@pytest.mark.parametrize("path", TOOL_FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_one_materials_file_serves_all_tools_files(path):
    assert load_tools(path)
    assert len(load_tools(path)) == len(load_tools(path, load_materials()))
    assert set(list_materials(path)) <= set(load_materials())


def test_data_set_needs_no_materials_of_its_own():
    assert set(list_materials(MODELS / "workshop" / "hps.yaml")) <= set(load_materials())
    assert not (MODELS / "workshop" / "materials.yaml").exists()


def test_no_two_materials_are_of_one_colour():
    """No two materials have the same colour, as knowledge of one would count for the other."""
    for one, other in itertools.combinations(load_materials().values(), 2):
        assert not is_same_colour(one.colour, other.colour), (one.name, other.name)


def test_source_of_a_density_may_be_left_out(tmp_path):
    path = tmp_path / "materials.yaml"
    path.write_text('oak: {colour: "#b07a45", density: 563, density_sd: 56}', encoding="utf-8")
    assert load_materials(path)["oak"].source == "no source is given"


def test_tool_is_read_as_written(files):
    (tool,) = files()
    head = tool.components[1]
    assert (head.material.name, head.looks_like.name) == ("beech", "brass")
    assert head.shape.semi_axes == (0.02, 0.05, 0.02)
    np.testing.assert_allclose(head.X_TE[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(head.looks_like.colour, [0xB5 / 255, 0xA6 / 255, 0x42 / 255])


def test_mass_and_centres_follow_from_the_parts(files):
    (tool,) = files()
    volumes = np.array([4 / 3 * np.pi * np.prod(part.shape.semi_axes) for part in tool.components])
    assert tool.mass == pytest.approx(720 * volumes.sum(), rel=1e-14)
    np.testing.assert_allclose(tool.p_TTcentre, [(volumes @ [0.1, 0.2]) / volumes.sum(), 0, 0], atol=1e-16)
    np.testing.assert_allclose(tool.p_TTcm, tool.p_TTcentre, atol=1e-16)


def test_centre_of_mass_leaves_the_geometric_centre_for_the_heavy_end(files):
    (tool,) = files(tools=GOOD_TOOLS.replace("material: beech\n        looks_like: brass", "material: brass"))
    assert tool.p_TTcm[0] > tool.p_TTcentre[0] + 0.02


def test_pose_cannot_be_changed_after_reading(files):
    (tool,) = files()
    with pytest.raises(ValueError, match="read-only"):
        tool.components[0].X_TE[0, 3] = 1.0


def test_decoy_appears_as_the_tool_it_imitates():
    *_, last, decoy = load_tools(MODELS / "tools" / "weight.yaml")
    assert decoy.appearance == last.appearance
    assert decoy.mass < 0.2 * last.mass


def test_numbers_may_be_written_with_an_exponent(files):
    (tool,) = files(tools=GOOD_TOOLS.replace("[0.1, 0.01, 0.01]", "[1e-1, 1.0e-2, 1E-2]", 1))
    assert tool.components[0].shape.semi_axes == (0.1, 0.01, 0.01)


def test_missing_and_binary_files_are_named(tmp_path):
    assert "nowhere.yaml: cannot be read: No such file" in refuse(load_materials, tmp_path / "nowhere.yaml")
    (tmp_path / "picture.yaml").write_bytes(b"\xff\xd8\xff\xe0\x00\x10")
    with pytest.raises(BadValueError, match=r"picture.yaml: is not a text file in UTF-8|picture.yaml.*is not YAML"):
        load_materials(tmp_path / "picture.yaml")
