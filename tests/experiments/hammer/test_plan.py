"""How the work of a blow depends on where parts sit, on an arm that is not ours."""

from functools import partial

import pytest
from helpers.slow_arm import make_slow_models

from affordance.choice.hammer import load_hammer
from affordance.choice.off_axis import list_shifted, measure_change
from affordance.experiments.hammer.plan import compute_blow_work
from affordance.objects.load import load_materials, load_tools
from affordance.plant.arm import ARM, load_arm
from affordance.plant.arm_model import ArmModel
from affordance.settings import Settings


def test_work_is_that_of_the_planned_blow_on_an_arm_of_any_speed(tmp_path, monkeypatch):
    models = make_slow_models(tmp_path)
    settings, task = Settings(arm=models / ARM.name), load_hammer(models / "nail.yaml")
    stick, *_ = load_tools(models / "tools" / "novel.yaml", load_materials(models / "materials.yaml"))
    grip = stick.grips[0]
    held = stick.gripped_by(grip)
    planned = task.build_cost(ArmModel(load_arm(settings.arm)), held.components, settings)
    assert planned.speeds[-1] < 1.0
    compute_work = partial(compute_blow_work, task, settings, {stick.name: {grip.name: planned}})
    (expected,) = planned.compute(held.parameters[None]).work
    assert compute_work(held) == pytest.approx(expected, rel=5e-3)
    monkeypatch.setattr("affordance.choice.off_axis.list_shifted", lambda tool: [*list_shifted(tool)][4:6])
    assert 0.0 < measure_change(compute_work, stick, grip) < 0.1
