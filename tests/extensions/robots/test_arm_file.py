"""Names of an imported arm: a file may give one name to a link and a joint, where an SDF may not."""

from pathlib import Path

import numpy as np
import pytest
from helpers.bench_arm import write_bench
from helpers.mujoco_parity import compare_with_mujoco
from helpers.refusals import refuse
from matplotlib.figure import Figure

from affordance.extensions.robots import report
from affordance.extensions.robots.home import plant_arm
from affordance.extensions.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.recorded_arm import find_flange, load_robot
from affordance.plant.arm_model import ArmModel

LINKS = ("s", "u", "f", "w1", "w2", "w3")
SAME = [(f'joint name="j_{name}"', f'joint name="{name}"') for name in LINKS]


@pytest.fixture(autouse=True)
def _without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out the picture of the report, which takes longer than the import."""
    monkeypatch.setattr(report, "draw_posture", lambda _: Figure())


@pytest.mark.parametrize(
    "changes", [SAME[2:3], SAME, [('joint name="j_s"', 'joint name="base"')], [('"j_w3"', '"flange"')]]
)
def test_joints_may_have_the_names_of_links(tmp_path: Path, changes: list[tuple[str, str]]) -> None:
    """Dynamics are those of the arm whose names all differ."""
    (tmp_path / "plain").mkdir()
    arms = [
        read_arm(write_bench(folder, *each), ImportOptions("flange"))
        for folder, each in ((tmp_path / "plain", []), (tmp_path, changes))
    ]
    plain, same = (ArmModel(plant_arm(arm)) for arm in arms)
    for x in np.random.default_rng(1).uniform(-2.0, 2.0, (50, 18)):
        torques = []
        for model in (plain, same):
            model.set_state(x[:12])
            torques.append(model.compute_inverse_dynamics(x[12:]))
        np.testing.assert_allclose(torques[0], torques[1], rtol=1e-12, atol=1e-12)


def test_mjcf_may_give_joints_the_names_of_bodies(tmp_path: Path) -> None:
    path = write_bench(tmp_path, *SAME, mjcf=True)
    assert compare_with_mujoco(path, read_arm(path, ImportOptions("flange"))) < 1e-9


def test_tip_with_the_name_of_a_joint_is_found_again(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('"j_w3"', '"flange"'))
    import_arm(path, ImportOptions("flange"), tmp_path / "arm", with_meshes=False, fits_tasks=False)
    found = find_flange(load_robot(tmp_path / "arm"))
    assert found is not None
    assert found.name == "flange_link"


def test_joint_with_the_name_of_the_hand_is_refused(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('"j_w1"', '"hand_grip"'))
    assert "joint hand_grip: has a name that is reserved for the hand" in refuse(
        extract_arm, path, ImportOptions("flange")
    )
