"""The study of recordings, on generated runs: the recordings themselves are not in the repository."""

from pathlib import Path

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, build_robot, generate_run
from helpers.refusals import refuse
from helpers.results_files import OF_STUDY, find_documented_keys, read_numbers
from helpers.study_runs import run_study
from numpy.testing import assert_allclose

from affordance.extensions.payload.posterior.log_cholesky import is_possible
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from studies.payload import clones, command
from studies.payload.clones import UR10E_LOAD, PandaData, Ur10eData
from studies.payload.panda import draw_payload


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory):
    """Numbers of the study, with a generated pair of runs with currents, and torques of an empty hand."""
    folder = tmp_path_factory.mktemp("study")
    robot = build_robot(folder)
    rng = np.random.default_rng(4)
    truth = Truth(gain=0.1, load_friction=0.1, friction=(2.0, 1.0, 0.5), noise_sd=0.05)
    pi = PAYLOAD * UR10E_LOAD / PAYLOAD[0]
    pair = [
        generate_run(robot, load, truth=truth, rng=rng, kind=SignalKind.CURRENT, duration=24.0, rate=40.0)
        for load in (None, pi)
    ]
    truth = Truth(friction=(0.2, 0.1, 0.1), noise_sd=0.2, agreement=0.5, file_error=0.05)
    empty = generate_run(robot, None, truth=truth, rng=np.random.default_rng(5), duration=20.0, rate=40.0)
    data = Ur10eData(robot, *pair)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "load_ur10e", lambda data_folder: data)
        patch.setattr(command, "load_panda", lambda data_folder: PandaData(robot, empty))
        patch.setattr(
            command, "IdentificationSettings", lambda seed: IdentificationSettings(num_samples=500, seed=seed)
        )
        run_study(command.STUDY, "--data", folder, "--injections", 3, "--out", folder)
    return read_numbers(folder / "payload")


def test_load_of_a_pair_is_found_in_each_half(found):
    numbers = found["ur10e"]
    assert (np.abs(numbers["half_error"]) < 3.0 * np.array(numbers["half_sd_kg"]) / UR10E_LOAD).all()
    assert_allclose(numbers["load_friction"], 0.1, atol=0.03)
    assert abs(numbers["unpaired_mass_kg"] - UR10E_LOAD) < 3.0 * numbers["unpaired_mass_sd_kg"]


def test_payloads_in_windows_are_covered_unless_errors_are_taken_for_white(found):
    numbers = found["panda"]
    assert set(numbers) == {"2", "5", "10", "white_5"}
    assert numbers["5"]["coverage_mass"] >= 0.5
    # White noise claims far more than it should.
    assert numbers["white_5"]["median_sd_mass_g"] < 0.3 * numbers["5"]["median_sd_mass_g"]


def test_keys_are_those_of_the_page(found):
    of_page = find_documented_keys("Payloads in recordings")
    assert set(found) - OF_STUDY | set(found["ur10e"]) | set(found["panda"]["5"]) == of_page


def test_random_payloads_are_possible_and_weigh_what_was_drawn():
    rng = np.random.default_rng(8)
    payloads = np.array([draw_payload(rng, (0.1, 3.0)) for _ in range(50)])
    assert is_possible(payloads).all()
    assert 0.07 < payloads[:, 0].min() < payloads[:, 0].max() < 4.0


def test_the_panda_of_the_study_has_seven_joints_and_weighs_what_it_should():
    panda = load_robot(Path(clones.__file__).with_name("panda.urdf"), "panda_link8")
    assert panda.joint_names == tuple(f"panda_joint{k}" for k in range(1, 8))
    assert panda.link_parameters[:, 0].sum() == pytest.approx(16.06, abs=0.01)


def test_a_missing_clone_is_named_before_anything_is_run(tmp_path):
    words = ("--data", tmp_path, "--out", tmp_path / "results")
    said = refuse(run_study, command.STUDY, *words)
    assert "ur10e.urdf: is missing; --data must contain clones" in said
    assert "of dynamic_calib" in said
    assert not (tmp_path / "results").exists()
    assert "--injections: is 0, must be from 1 to 100000" in refuse(
        run_study, command.STUDY, *words, "--injections", 0
    )
