"""Volume that solids share is counted once, by closed forms."""

import numpy as np
import pytest

from affordance.commands.advice.new_tools import _TEMPLATE
from affordance.objects.drake_geometry import make_drawn_shape
from affordance.objects.inertia import Ellipsoid, LoadedShape
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.overlap import count_once
from affordance.objects.primitives import Box, Cylinder
from affordance.objects.tool import Component, Tool, Weighing
from affordance.objects.tool_entries import build_pose

STEEL, OAK = load_materials()["steel"], load_materials()["oak"]


def place(shape, position=(0.0, 0.0, 0.0), material=STEEL, rpy_deg=None):
    return Component(shape, build_pose(position, rpy_deg), material, material)


BLOCK = place(Box((0.2, 0.04, 0.04)), (0.1, 0.0, 0.0))


def test_a_block_that_is_drawn_twice_weighs_once(tmp_path, caplog):
    part = "{box: [0.2, 0.04, 0.04], position: [0.1, 0, 0], material: steel}"
    path = tmp_path / "tools.yaml"
    path.write_text(f"tools: [{{name: once, components: [{part}]}}, {{name: twice, components: [{part}, {part}]}}]")
    once, twice = load_tools(path)
    np.testing.assert_allclose(twice.parameters, once.parameters, rtol=1e-12)
    assert "tools.yaml: twice: its parts share 50.0 % of their volume, which is counted once" in caplog.text
    assert "once:" not in caplog.text.replace("counted once:", "")


def test_a_handle_that_is_listed_first_keeps_its_volume_in_the_head():
    handle = place(Cylinder(0.014, 0.28), (0.1, 0.0, 0.0), OAK, (0.0, 90.0, 0.0))
    head = place(Box((0.03, 0.03, 0.09)), (0.225, 0.0, 0.0))
    (same, cut), kept, shared = count_once([handle, head])
    hole = np.pi * 0.014**2 * 0.03
    assert same is handle
    assert kept == (0, 1)
    assert cut.shape.volume == pytest.approx(8.1e-5 - hole, rel=1e-3)
    assert shared == pytest.approx(hole / (8.1e-5 + np.pi * 0.014**2 * 0.28), rel=2e-3)
    # About the cylinder's axis, Ex: the block's moment less that of a cylinder.
    moments = Tool("head", (cut,)).parameters / STEEL.density
    assert moments[4] == pytest.approx(8.1e-5 * (0.03**2 + 0.09**2) / 12.0 - 0.5 * hole * 0.014**2, rel=1e-3)
    assert moments[1:4] == pytest.approx([0.225 * cut.shape.volume, 0.0, 0.0], rel=1e-9, abs=1e-12)
    np.testing.assert_array_equal(cut.shape.find_support(np.array([1.0, 0.0, 0.0])), [0.015, 0.0, 0.0])


def test_a_core_keeps_its_volume_wherever_it_is_listed():
    core = place(Ellipsoid((0.015, 0.015, 0.015)), (0.15, 0.0, 0.0), OAK)
    for parts in ((BLOCK, core), (core, BLOCK)):
        tool = Tool("filled", count_once(parts).parts)
        ball = 4.0 / 3.0 * np.pi * 0.015**3
        steel = STEEL.density * (3.2e-4 - ball)
        assert tool.mass == pytest.approx(steel + OAK.density * ball, rel=1e-3)
        moment = STEEL.density * (3.2e-4 * 0.1 - ball * 0.15) + OAK.density * ball * 0.15
        assert tool.p_TTcm == pytest.approx([moment / tool.mass, 0.0, 0.0], rel=1e-3, abs=1e-9)


def test_shared_threads_and_parts_that_touch_stay_as_they_are():
    for gap in (-0.001, 0.0, 0.01):
        next_to_it = place(Box((0.2, 0.04, 0.04)), (0.3 + gap, 0.0, 0.0))
        assert count_once([BLOCK, next_to_it]).parts == (BLOCK, next_to_it)


def test_weighings_are_those_of_the_parts_that_are_left():
    end = place(Box((0.04, 0.04, 0.04)), (0.22, 0.0, 0.0))
    counted = count_once([BLOCK, BLOCK, end])
    assert counted.kept == (0, 2)
    whole, first, second, last = Weighing((), 3.0, 0.1), Weighing((0,), 2.5, 0.1), Weighing((1,), 2.5, 0.1), (2,)
    assert counted.renumber([whole, first, second]) == (whole, first)
    assert counted.renumber([Weighing(last, 0.5, 0.1)]) == (Weighing((1,), 0.5, 0.1),)


def test_a_stretched_solid_keeps_its_distribution():
    """A half-filled block is a block: closed form at every size."""
    half = place(Box((0.1, 0.04, 0.04)), (0.0, 0.0, 0.0)).shape.unit_pseudo_inertia()
    shift = build_pose((-0.05, 0.0, 0.0))
    solid = LoadedShape(Box((0.2, 0.04, 0.04)), shift @ half @ shift.T).with_sizes(np.array([0.4, 0.04, 0.08]))
    shift = build_pose((-0.1, 0.0, 0.0))
    expected = shift @ Box((0.2, 0.04, 0.08)).unit_pseudo_inertia() @ shift.T
    np.testing.assert_allclose(solid.unit_pseudo_inertia(), expected, rtol=1e-12, atol=1e-20)
    assert solid.volume == pytest.approx(0.2 * 0.04 * 0.08)


def test_a_part_with_a_hole_is_drawn_as_it_looks():
    hollow = LoadedShape(BLOCK.shape, 0.5 * BLOCK.shape.unit_pseudo_inertia())
    assert make_drawn_shape(hollow).size() == pytest.approx([0.2, 0.04, 0.04])
    assert hollow == LoadedShape(BLOCK.shape, hollow.J)
    assert len({hollow, LoadedShape(BLOCK.shape, hollow.J), BLOCK.shape}) == 2


def test_no_volume_of_the_template_is_shared(tmp_path, caplog):
    path = tmp_path / "tools.yaml"
    path.write_text(_TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
    load_tools(path)
    assert not caplog.text
