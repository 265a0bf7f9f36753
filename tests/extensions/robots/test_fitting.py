"""Tasks are changed to what an arm can do, in the documented order, and every change is written down."""

import re
from pathlib import Path

import pytest
import yaml

from affordance.choice.hammer import Hammer, load_hammer
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import NoPlanError
from affordance.extensions.robots import fitting
from affordance.extensions.robots.fitting import (
    CARRY,
    NAIL,
    PATH,
    SIZE_OF_TOOLS,
    Change,
    apply_changes,
    fit_blow,
    fit_carry,
    fit_objects,
    fit_path,
    measure_holding,
)
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.simulation import rollout
from affordance.simulation.blow import describe_blow_fault
from affordance.simulation.rollout import describe_path_fault

ARM_FILES = ("arm.sdf", "arm.dmd.yaml", "package.xml", "materials.yaml", "nail.yaml")


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A copy of our own models."""
    for file in (*ARM_FILES, *(f"tools/{name}.yaml" for name in ("weight", "com", "novel", "uncommon")), PATH, CARRY):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_bytes((MODELS / file).read_bytes())
    return tmp_path


def change_joint(models: Path, joint: str, old: str, new: str) -> None:
    """Changes a text of a joint in our arm's file, given as a pattern."""
    before, name, after = (models / "arm.sdf").read_text().partition(f'joint name="{joint}"')
    assert re.search(old, after)
    (models / "arm.sdf").write_text(before + name + re.sub(old, new, after, count=1))


def test_objects_that_a_weak_wrist_cannot_hold_are_made_smaller_until_it_can(models: Path) -> None:
    change_joint(models, "wrist_flexion", "<effort>7.1", "<effort>3")
    assert measure_holding(models).load > 1.0
    fit = fit_objects(models)
    assert {change.key for change in fit.changes} == {SIZE_OF_TOOLS}
    assert "loads wrist_flexion with" in fit.changes[0].why
    factor = fit.changes[0].new
    materials = load_materials(models / "materials.yaml")
    before = [tool.mass for tool in load_tools(models / "tools" / "weight.yaml", materials)]
    expected = measure_holding(models, factor)
    apply_changes(models, fit.changes)
    after = load_tools(models / "tools" / "weight.yaml", materials)
    assert [tool.mass for tool in after] == pytest.approx([factor**3 * mass for mass in before], rel=1e-4)
    assert measure_holding(models).load == pytest.approx(expected.load, rel=1e-4)
    assert measure_holding(models).load <= 0.8
    assert fit_objects(models).changes == ()


def test_an_arm_that_can_hold_nothing_is_told_by_joint_and_kilograms(models: Path) -> None:
    change_joint(models, "shoulder_elevation", "<effort>68.6", "<effort>11.5")
    fit = fit_objects(models)
    assert fit.changes == ()
    assert "of 1.00 kg loads shoulder_elevation with" in fit.lack
    assert "% of its torque limit, and still" in fit.lack


def test_paths_are_tried_as_they_are_then_mirrored_then_slower_and_last_smaller(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def refuse(model: object, path: TimedPath, *others: object) -> str:
        tried.append((path.points[0][1], path.points[0][2], path.duration))
        return "is too much" if len(tried) < 13 else ""

    monkeypatch.setattr(fitting, "_find_lack", refuse)
    fit = fit_path(models, describe_path_fault)
    left, up, duration = 0.2, 0.2, 2.0
    assert tried[:4] == [(left, up, duration), (-left, up, duration), (left, up, 2.5), (-left, up, 2.5)]
    assert tried[10:12] == [(0.15, 0.15, 2.0), (-0.15, 0.15, 2.0)]
    assert [change.key for change in fit.changes] == ["points", "duration"]
    assert fit.changes[0].why == "unchanged, is too much; 0.75 times as large, 1.25 times slower"
    apply_changes(models, fit.changes)
    assert load_path(models / PATH).points[0] == pytest.approx((-0.075, 0.15, 0.15))


def test_the_object_that_a_path_failed_with_is_tried_first_with_the_next_path(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def fail(model: object, tool: Tool, path: object, settings: object) -> str:
        tried.append(f"{tool.name} by {tool.grip}")
        return "is too heavy" if tried[-1] == "hammer by steel" and len(tried) < 6 else ""

    monkeypatch.setattr(fitting, "_find_lack_of_plan", fail)
    fit_path(models, lambda *arguments: "")
    assert tried[3:7] == ["hammer by steel", "hammer by steel", "hammer by steel", "stick by wood"]


def test_a_motion_that_the_controller_finds_no_plan_for_is_no_path(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*arguments: object) -> None:
        raise NoPlanError(0.3)

    monkeypatch.setattr(fitting, "_find_lack_of_plan", lambda *arguments: "")
    monkeypatch.setattr(rollout, "roll_out", stop)
    said = "no plan keeps the joints' position and velocity limits at t = 0.300 s"
    assert said in fit_path(models, describe_path_fault).lack


def test_a_path_for_a_slow_arm_is_made_slower_and_can_then_be_followed(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hold_one_object(monkeypatch)
    for joint in ("shoulder_azimuth", "shoulder_elevation", "shoulder_rotation", "elbow_flexion"):
        change_joint(models, joint, r"<velocity>[\d.]+", "<velocity>0.35")
    fit = fit_path(models, describe_path_fault)
    assert "duration" in [change.key for change in fit.changes]
    apply_changes(models, fit.changes)
    assert load_path(models / PATH).duration > load_path(MODELS / PATH).duration
    assert fit_path(models, describe_path_fault).changes == ()


def test_a_nail_for_a_weak_shoulder_is_driven_less_deep(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hold_one_object(monkeypatch)
    monkeypatch.setattr(fitting, "_SWING_PACES", (1.0,))
    change_joint(models, "shoulder_elevation", "<effort>68.6", "<effort>14")
    fit = fit_blow(models, describe_blow_fault)
    (depth,) = fit.changes
    assert depth.key == "depth_demanded"
    assert "must bear" in depth.why
    assert depth.new < depth.old == load_hammer(MODELS / NAIL).nail.depth_demanded
    apply_changes(models, fit.changes)
    assert fit_blow(models, describe_blow_fault).changes == ()


def test_the_object_that_limits_the_depth_is_planned_first_at_the_next_pace(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slower swings that reach no deeper are given up after one plan; the result is that of all plans."""
    depths, planned = {}, list[tuple[str, str]]()
    for k, tool in enumerate(fitting.list_held(models, ("tools/novel.yaml",))):
        depths[tool.name, tool.grip] = 0.016 + 1e-4 * ((k + 3) % 10)

    class Cost:
        def explain_infeasibility(self, _: object) -> str:
            return "is too slow"

    def reach(_: Cost, tool: Tool) -> float:
        planned.append((tool.name, tool.grip))
        return depths[tool.name, tool.grip]

    monkeypatch.setattr(fitting, "_bound_depth", reach)
    monkeypatch.setattr(Hammer, "build_cost", lambda *_: Cost())
    found = fit_blow(models, lambda *_: "")
    assert len(planned) == len(depths) + 2
    assert planned[-2:] == [min(depths, key=depths.__getitem__)] * 2
    assert [(change.key, change.new) for change in found.changes] == [("depth_demanded", min(depths.values()))]


def test_a_blow_that_misses_its_force_in_contact_is_not_done_and_a_way_out_is_named(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a wrist damped as URDFs have it the blow misses 427 N by over 15 %; `--damping none` is the way out."""
    hold_one_object(monkeypatch, name="crooked stick", grip="steel")
    monkeypatch.setattr(fitting, "_SWING_PACES", (1.0,))
    for joint in ("forearm_rotation", "wrist_flexion", "wrist_deviation"):
        change_joint(models, joint, "</xyz>", "</xyz><dynamics><damping>1</damping></dynamics>")
    fit = fit_blow(models, describe_blow_fault)
    assert fit.changes == ()
    assert re.match(
        r"asked for 427 N, the crooked stick by steel gives \d{3} N, must agree with the demanded force to 15 %",
        fit.lack,
    )
    assert "import-arm --damping none" in fit.lack


def hold_one_object(monkeypatch: pytest.MonkeyPatch, *, name: str = "stick", grip: str = "wood") -> None:
    """Limits fitting to one of the novel objects in one grip, as planning takes long."""
    every = fitting.list_held

    def pick(models: Path, *files: object) -> list[Tool]:
        return [tool for tool in every(models, *files) if (tool.name, tool.grip) == (name, grip)]

    monkeypatch.setattr(fitting, "list_held", pick)


def test_what_is_carried_too_far_is_carried_less_far(models: Path) -> None:
    assert fit_carry(models) == ((), "")
    text = (models / CARRY).read_text()
    (models / CARRY).write_text(text.replace("[-0.15, 0.3, 0]", "[0.1, 0.45, 0]").replace("3.0", "1.0"))
    fit = fit_carry(models)
    assert fit.lack == ""
    assert {change.file for change in fit.changes} == {CARRY}
    assert "unchanged, " in fit.changes[0].why
    apply_changes(models, fit.changes)
    assert fit_carry(models) == ((), "")


def test_arm_that_can_carry_nothing_says_so_by_joint(models: Path) -> None:
    change_joint(models, "wrist_flexion", "<effort>7.1", "<effort>0.1")
    fit = fit_carry(models)
    assert fit.changes == ()
    assert "loads wrist_flexion with" in fit.lack


def test_a_change_is_said_at_the_top_of_its_file_and_leaves_the_rest(tmp_path: Path) -> None:
    (tmp_path / "nail.yaml").write_text((MODELS / "nail.yaml").read_text())
    apply_changes(tmp_path, [Change("nail.yaml", "blow.duration", 0.8, 1.6, "slow joints")])
    text = (tmp_path / "nail.yaml").read_text()
    assert text.startswith("# Changed by affordance import-arm: nail.yaml: blow.duration: 0.8 -> 1.6 (slow joints)\n")
    before = yaml.safe_load((MODELS / "nail.yaml").read_text())
    before["blow"]["duration"] = 1.6
    assert yaml.safe_load(text) == before
