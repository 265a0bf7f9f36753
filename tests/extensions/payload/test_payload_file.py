"""Files of a payload are read back by Drake, MuJoCo and Pinocchio as the body that was written."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from helpers.refusals import refuse
from numpy.testing import assert_allclose
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.extensions.payload.payload_file import Body, check_target, spread_moments, write_payload
from affordance.extensions.payload.payload_setting import read_payload

EXACT = 1e-9


def draw_clouds(num, seed=0):
    """Draws parameters about To of clouds of point masses, which are possible bodies: (num, 10), and the points."""
    rng = np.random.default_rng(seed)
    clouds = [(rng.uniform(0.05, 0.3, 12), rng.normal([0.05, -0.02, 0.1], 0.04, (12, 3))) for _ in range(num)]
    return np.array([measure_cloud(*each) for each in clouds])


def measure_cloud(masses, points):
    x, y, z = points.T
    products = [
        (masses * each).sum() for each in (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
    ]
    return np.array([masses.sum(), *(masses @ points), *products])


def read_with_drake(path):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    found = plant.GetBodyByName("payload").default_spatial_inertia()
    mass, centre = found.get_mass(), found.get_com()
    tensor = found.Shift(centre).CalcRotationalInertia().CopyToFullMatrix3()
    return mass, centre, tensor


def read_with_mujoco(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "payload")
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[k])
    R = R.reshape(3, 3)
    return model.body_mass[k], model.body_ipos[k], R @ np.diag(model.body_inertia[k]) @ R.T


def read_with_pinocchio(path):
    model = pinocchio.buildModelFromUrdf(str(path), pinocchio.JointModelFreeFlyer())
    found = model.inertias[1]
    return found.mass, found.lever, found.inertia


@pytest.mark.parametrize(
    ("suffix", "read"),
    [
        (".urdf", read_with_drake),
        (".urdf", read_with_mujoco),
        (".urdf", read_with_pinocchio),
        (".sdf", read_with_drake),
        (".xml", read_with_mujoco),
        (".xml", read_with_drake),
    ],
)
def test_the_link_is_read_back_as_it_was_written(tmp_path, suffix, read):
    pi = draw_clouds(1)
    write_payload(tmp_path / f"payload{suffix}", pi, "tool0 -- flange")
    written = Body.from_parameters(pi[0])
    mass, centre, tensor = read(tmp_path / f"payload{suffix}")
    assert_allclose(mass, pi[0, 0], atol=EXACT)
    assert_allclose(centre, pi[0, 1:4] / pi[0, 0], atol=EXACT)
    assert_allclose(tensor, written.inertia, atol=EXACT)


def test_moments_are_about_the_centre_of_mass():
    """Against the definition, for points of known places."""
    masses, points = np.array([0.2, 0.3, 0.4, 0.1]), np.random.default_rng(1).normal(0.1, 0.05, (4, 3))
    body = Body.from_parameters(measure_cloud(masses, points))
    away = points - masses @ points / masses.sum()
    assert_allclose(
        body.inertia,
        sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, away, strict=True)),
        atol=1e-12,
    )


def test_a_thin_rod_has_moments_that_a_simulator_takes(tmp_path):
    rod = measure_cloud(np.array([0.5, 0.5]), np.array([[0.0, 0.0, 0.1], [0.0, 0.0, -0.1]]))
    write_payload(tmp_path / "rod.xml", rod[None], "tip")
    _, _, tensor = read_with_mujoco(tmp_path / "rod.xml")
    assert_allclose(np.diagonal(tensor), [0.01, 0.01, 0.0], atol=1e-8)


def test_draws_scatter_as_the_samples_and_all_are_bodies(tmp_path):
    pi = draw_clouds(300, seed=2)
    weights = np.r_[np.zeros(100), np.ones(200)]
    names = write_payload(tmp_path / "p.json", pi, "tip", weights=weights, draws=400)
    bodies = [json.loads((tmp_path / name).read_text()) for name in names]
    assert (len(names), names[0], names[1]) == (401, "p.json", "p_001.json")
    masses = np.array([each["mass"] for each in bodies[1:]])
    assert set(masses) <= set(pi[100:, 0])
    assert masses.std() == pytest.approx(pi[100:, 0].std(), rel=0.15)
    assert bodies[0]["mass"] == pytest.approx(pi[100:, 0].mean())


def test_json_is_what_a_controllers_payload_is_read_from(tmp_path):
    pi = draw_clouds(1)
    write_payload(tmp_path / "p.json", pi, "tool0")
    setting = read_payload(tmp_path / "p.json")
    assert_allclose(setting.parameters, pi[0], atol=1e-12)


def test_moments_that_were_not_measured_are_those_of_a_ball():
    mass = np.full(4000, 1.0)
    bodies = spread_moments(np.column_stack([mass, np.tile([0.1, 0.0, 0.0], (4000, 1))]), np.random.default_rng(0))
    radius = (3.0 / (4.0 * np.pi * 1000.0)) ** (1.0 / 3.0)
    assert np.median(bodies[:, 4]) == pytest.approx(0.4 * radius**2, rel=0.05)
    assert np.median(bodies[:, 5]) == pytest.approx(0.4 * radius**2 + 0.01, rel=0.05)


@pytest.mark.parametrize(
    ("path", "draws", "said"),
    [
        ("payload.stl", 0, "--write: is 'payload.stl', must end with .urdf, .sdf, .xml, .json"),
        ("payload.xml", -1, "--draws: is -1, must be from 0 to 10000"),
        (None, 3, "--draws: is 3, must be given with --write FILE"),
    ],
)
def test_bad_targets_are_refused(path, draws, said):
    assert refuse(check_target, None if path is None else Path(path), draws) == said
