"""``affordance compare-payloads``: verdicts, frames and what is refused."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from numpy.testing import assert_allclose

from affordance.extensions.payload.payload_comparison import compare_estimates, read_estimate

ROBOT = """<robot name="r"><link name="base"/>
<link name="arm"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="1" effort="9"/></joint>
<link name="flange"/><joint name="f" type="fixed"><parent link="arm"/><child link="flange"/></joint>
<link name="sensor"/><joint name="s" type="fixed"><parent link="flange"/><child link="sensor"/>
<origin xyz="0 0 0.04" rpy="0 0 1.5707963267948966"/></joint></robot>"""


def write(path, mass, centre, sd, frame="flange", trusted=True, rho=0.0):
    """Writes an answer as ``identify`` does, with SDs of mass and first moment."""
    parameters = mass * np.array([1.0, *centre])
    covariance = np.diag(np.square(sd)) + 0.0
    covariance[0, 1] = covariance[1, 0] = rho * sd[0] * sd[1]
    content = {"frame": frame, "trusted": trusted, "parameters": list(parameters)}
    path.write_text(json.dumps(content | {"parameters_covariance": covariance.tolist()}))
    return path


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.urdf").write_text(ROBOT)
    write(tmp_path / "a.json", 0.5, [0.0, 0.01, 0.05], [0.01, 0.001, 0.001, 0.001])
    write(tmp_path / "b.json", 0.51, [0.001, 0.01, 0.051], [0.01, 0.001, 0.001, 0.001])
    write(tmp_path / "vague.json", 0.6, [0.0, 0.01, 0.05], [0.2, 0.001, 0.001, 0.001])
    (tmp_path / "sheet.yaml").write_text("mass: 0.7\ncom: [0, 0.01, 0.05]\nframe: flange\n")
    return tmp_path


def test_files_of_one_name_are_told_apart_by_their_folders(folder):
    (folder / "today").mkdir()
    write(folder / "today" / "a.json", 0.7, [0.0, 0.01, 0.05], [0.01, 0.001, 0.001, 0.001])
    assert answer("compare-payloads", "a.json", "today/a.json").lines[0].startswith("a.json and today/a.json are")


@pytest.mark.parametrize(
    ("other", "verdict", "said"),
    [
        ("b.json", "same", "can be the same body"),
        ("sheet.yaml", "different", "are different bodies"),
        ("vague.json", "open", "may be the same body or not"),
    ],
)
def test_verdicts(other, verdict, said):
    said_lines = answer("compare-payloads", "a.json", other).lines
    assert said in said_lines[0]
    content = answer("compare-payloads", "a.json", other, "--json").content
    assert content["verdict"] == verdict
    assert content["apart"][0] == pytest.approx(
        {"b.json": 0.01 / np.hypot(0.01, 0.01), "sheet.yaml": 20.0, "vague.json": 0.1 / np.hypot(0.01, 0.2)}[other]
    )
    if verdict == "open":
        assert content["decides"] == "a smaller SD of the mass in vague.json, now 0.2 kg"
        assert said_lines[1] == f"Would decide: {content['decides']}"


def test_two_draws_of_one_body_differ_as_often_as_is_said(folder):
    """Of pairs that are drawn as their covariances say, one in a hundred is called different."""
    a, rng = read_estimate(folder / "a.json"), np.random.default_rng(0)
    root = np.linalg.cholesky(a.covariance)
    drawn = [[a._replace(mean=a.mean + root @ rng.standard_normal(4)) for _ in range(2)] for _ in range(1000)]
    verdicts = [compare_estimates(*pair).verdict for pair in drawn]
    assert 2 <= verdicts.count("different") <= 22


def test_the_centre_has_the_sd_of_samples(folder):
    write(folder / "c.json", 0.5, [0.1, 0.0, 0.05], [0.01, 0.002, 0.001, 0.003], rho=0.6)
    estimate = read_estimate(folder / "c.json")
    samples = np.random.default_rng(0).multivariate_normal(estimate.mean, estimate.covariance, 100_000)
    assert_allclose(estimate.describe()[1][1:], (samples[:, 1:] / samples[:, :1]).std(axis=0), rtol=0.02)


def test_frames_are_converted_with_the_robots_file(folder):
    # The sensor is 40 mm above the flange and turned by 90 degrees about z: x of the sensor is y of the flange.
    write(folder / "s.json", 0.5, [0.01, 0.0, 0.01], [0.01, 0.001, 0.001, 0.001], frame="sensor")
    alone = answer("compare-payloads", "a.json", "s.json", "--json").content
    assert alone["parameters"] == ["mass"]
    assert "Only the masses are compared" in answer("compare-payloads", "a.json", "s.json").lines[-1]
    content = answer("compare-payloads", "a.json", "s.json", "--robot", "robot.urdf", "--json").content
    assert_allclose(content["values"][1], [0.5, 0.0, 0.01, 0.05], atol=1e-12)
    assert content["verdict"] == "same"


def test_what_was_not_trusted_has_status_3(folder):
    write(folder / "d.json", 0.5, [0.0, 0.01, 0.05], [0.01, 0.001, 0.001, 0.001], trusted=False)
    assert "d.json was not to be trusted" in answer("compare-payloads", "a.json", "d.json", status=3).lines[-1]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"parameters_covariance": [[1]]}', "x.json: parameters: are missing or not numbers"),
        (
            '{"parameters": [1, 0, 0, 0], "parameters_covariance": [[1]]}',
            "x.json: parameters_covariance: has the shape",
        ),
        ('{"mass": 1, "weight": 2}', "x.json: weight: is not a key known here"),
        ("[]", "x.json: is not a mapping"),
        ("{", "x.json: is not JSON"),
    ],
)
def test_files_without_a_payload_are_refused(folder, content, said):
    (folder / "x.json").write_text(content)
    assert said in refuse_command("compare-payloads", "a.json", "x.json")


def test_numbers_without_uncertainty_are_refused():
    said = refuse_command("compare-payloads", "sheet.yaml", "sheet.yaml")
    assert "sheet.yaml: has no uncertainty, nor has sheet.yaml" in said
