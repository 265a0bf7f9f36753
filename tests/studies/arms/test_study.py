"""The study of arms: claims, tables and texts by made-up numbers, and the names of its arms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse

from affordance.files.model_folder import MODELS
from studies.arms import measure
from studies.arms.command import choose_robots
from studies.arms.figure import draw_study
from studies.arms.measure import measure_sag
from studies.arms.report import describe
from studies.arms.robot_study import EXPERIMENTS
from studies.arms.robots import ROBOTS

SAG = {"arm_mass": 2.0, "object_mass": 0.4, "predicted": 0.02, "simulated": 0.022, "rate": 0.3, "rate_joint": "j5"}
REFUSED = {"required": False, "metrics": {"loads": False, "experiments": dict.fromkeys(EXPERIMENTS, "no such tip")}}


def invent(**changes: Any) -> dict[str, Any]:
    """Made-up findings about a robot."""
    sag = {**SAG, "limited": 0.0, "real_time_factor": 12.0}
    found = {
        "required": True,
        "metrics": {
            "loads": True,
            "joints": 7,
            "frozen_joints": 2,
            "parity_error": 1e-15,
            "payload_kg": 4.0,
            "home_torque_ratio": 0.4,
            "experiments": dict.fromkeys(EXPERIMENTS, "ok"),
            "real_time_factor": 12.0,
            "changed": [],
        },
        "sag": sag,
        "heavy": {**sag, "rate": 0.9},
        "sag_with_rotors": {"0.1": {**sag, "arm_mass": 4.0, "predicted": 0.012, "simulated": 0.013}},
        "claims": {"weight": {"the drop falls": True, "the decoy rises": False}},
        "weight": {"drop_m": [0.022, 0.01], "decoy_lift_m": 0.04},
        "reach": {"energy_ratio_true": 1.02},
        "hammer": {"energy_ratio_true": 1.01},
    }
    found.update(changes)
    return found


def test_claims_are_met_by_numbers_that_meet_them_and_not_by_others() -> None:
    ours = invent()
    met = describe({"a": invent(), "b": invent()}, ours)
    assert all(claim.met for claim in met.claims)
    one = invent()
    one["metrics"] = {**one["metrics"], "parity_error": 1e-8, "real_time_factor": 4.9}
    one["metrics"]["experiments"] = {**one["metrics"]["experiments"], "hammer": "too weak"}
    worse = describe({"a": invent(), "b": one}, ours)
    assert [claim.met for claim in worse.claims] == [False, False, False]
    assert [claim.criteria[0].value for claim in worse.claims] == ["50 %", "1.0 × 10^-8", "4.9"]


def test_a_robot_that_is_not_required_may_lack_an_experiment() -> None:
    other = invent(required=False)
    other["metrics"] = {**other["metrics"], "experiments": dict.fromkeys(EXPERIMENTS, "too weak")}
    assert describe({"a": invent(), "b": other}, invent()).claims[0].met
    assert not describe({"b": other}, invent()).claims[0].met  # none that must have them was studied


def test_a_joint_beyond_its_rate_is_named() -> None:
    over = invent(heavy={**invent()["heavy"], "rate": 2.17, "rate_joint": "wrist"})
    assert "kinova 2.17 (wrist)" in describe({"kinova": over}, invent()).summary
    assert "largest rates over their limits" not in describe({"a": invent()}, invent()).summary


def test_summary_tells_falls_drops_and_costs_of_those_that_were_imported() -> None:
    found = {
        name: invent(reach={"energy_ratio_true": 1.0 + 0.01 * k}, sag={**invent()["sag"], "arm_mass": 5.0 - k})
        for k, name in enumerate("abc", start=1)
    }
    for one in found.values():
        del one["hammer"]
    found["c"]["weight"] = {"drop_m": [0.03, 0.01]}
    summary = describe(found, invent()).summary
    assert (
        "On the 3 arms that meet no limit the first object falls 1.10 to 1.10 times as far as predicted:" in summary
    )
    assert "The first drop is 2.2 cm (a) to 3.0 cm (c); on our own arm it is 2.2 cm." in summary
    assert "In reaching the costlier grip costs 1.0 to 3.0 % more; its rank correlation" in summary
    assert "effective mass divided by the object's mass is -1.00." in summary
    assert "hammering" not in summary
    assert describe({"odd": REFUSED}, invent()).summary.endswith("No robot was imported.")


def test_tables_show_robots_that_were_refused_and_claims_by_robot() -> None:
    robots, verdicts = describe({"panda": invent(), "odd": REFUSED}, invent()).tables
    assert robots.rows[1][:2] == ["odd", "no such tip"]
    assert ["weight: the drop falls", "met"] in verdicts.rows
    assert ["weight: the decoy rises", "not met"] in verdicts.rows
    assert {len(row) for row in robots.rows} == {len(robots.header)}
    assert {len(row) for row in verdicts.rows} == {len(verdicts.header)}


def test_the_figure_has_a_point_for_every_robot_that_was_imported() -> None:
    figure = draw_study({"panda": invent(), "odd": REFUSED}, invent())
    assert len(figure.axes) == 3
    for axes in figure.axes:
        assert {text.get_text() for text in axes.texts} == {"panda", "ours"}


def test_the_formula_predicts_a_small_sag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # With heavy rotors our arm sags little, and the formula, which is of small angles and of rest, must hold.
    monkeypatch.setattr(measure, "_TIMES", 1)
    for name in ("package.xml", "arm.dmd.yaml"):
        (tmp_path / name).write_text((MODELS / name).read_text())
    rotor = "<drake:rotor_inertia>0.5</drake:rotor_inertia><drake:gear_ratio>1</drake:gear_ratio></joint>"
    (tmp_path / "arm.sdf").write_text((MODELS / "arm.sdf").read_text().replace("</joint>", rotor))
    sag = measure_sag(tmp_path, task_models=MODELS)
    assert 0.01 < sag.predicted < 0.03
    # A double integrator under this plan overshoots by exp(-pi z / sqrt(1 - z^2)), z = 2 / sqrt(6): by 1 %.
    assert sag.simulated == pytest.approx(1.01 * sag.predicted, rel=0.05)
    assert sag.limited == 0.0


def test_a_heavier_arm_sags_less() -> None:
    light, heavy = measure_sag(MODELS, 0), measure_sag(MODELS, 3)
    assert heavy.object_mass > light.object_mass
    assert heavy.arm_mass == pytest.approx(light.arm_mass)
    assert heavy.predicted > light.predicted
    assert np.isfinite(heavy.real_time_factor)


def test_a_wrong_folder_or_name_is_refused() -> None:
    assert "--robots: is 'nowhere', which has no file of these robots" in refuse(choose_robots, Path("nowhere"))
    said = answer("study", "arms", "--robots", "nowhere", "--only", "pandas", status=2).err
    assert "--only: is 'pandas', must be one of panda, ur5" in said


def test_robots_have_names_of_their_own() -> None:
    names = [robot.name for robot in ROBOTS]
    assert len(set(names)) == len(names)
    assert sum(robot.required for robot in ROBOTS) == 10
