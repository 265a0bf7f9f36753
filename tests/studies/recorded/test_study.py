"""The study, as far as its recordings are in the repository; the rest of it on generated runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run
from helpers.refusals import refuse
from helpers.study_runs import run_study
from numpy.testing import assert_allclose

from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.posterior.log_cholesky import is_possible
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import pseudo_inertia_from_parameters
from affordance.robots.recorded_arm import load_robot
from studies.recorded import clones
from studies.recorded.clones import LBIPE_OBJECTS, PandaData, Ur10eData, load_weighed_objects
from studies.recorded.command import STUDY, list_weighings
from studies.recorded.figures import draw_injections, draw_masses, draw_peers
from studies.recorded.panda import study_panda
from studies.recorded.peers import solve_least_squares, solve_semidefinite
from studies.recorded.random_payloads import draw_payload
from studies.recorded.simulated_truths import World, measure_coverage
from studies.recorded.timing import compare_peers
from studies.recorded.ur10e import study_ur10e
from studies.recorded.weighed_objects import SERVO_PRIOR, study_weighed_objects

_DATA = Path(__file__).parents[2] / "data"
_SETTINGS = IdentificationSettings(num_samples=500)


@pytest.fixture(scope="module")
def weighed():
    return study_weighed_objects(load_weighed_objects(_DATA), replace(_SETTINGS, signal_prior=SERVO_PRIOR))


def test_weighed_objects_on_a_real_arm_lie_inside_their_intervals(weighed):
    assert tuple(weighed.beliefs) == LBIPE_OBJECTS
    assert weighed.numbers["inside"] == 3
    assert weighed.numbers["rmse_g"] < 9.0
    assert all(is_possible(belief.bodies.pi).all() for belief in weighed.beliefs.values())


def test_study_of_a_pair_and_its_figures(robot, weighed):
    rng = np.random.default_rng(4)
    truth = Truth(gain=0.1, load_friction=0.1, friction=(2.0, 1.0, 0.5), noise_sd=0.05)
    pi = PAYLOAD * 2.805 / PAYLOAD[0]
    empty, loaded = (
        generate_run(robot, load, truth=truth, rng=rng, kind=SignalKind.CURRENT, duration=24.0, rate=40.0)
        for load in (None, pi)
    )
    result = study_ur10e(Ur10eData(robot, empty, loaded), _SETTINGS)
    numbers = result.numbers
    assert set(numbers) == {
        "half_error",
        "half_inside",
        "half_sd_kg",
        "load_friction",
        "empty_as_load_kg",
        "empty_as_load_sd_kg",
    }
    assert (np.abs(numbers["half_error"]) < 3.0 * numbers["half_sd_kg"] / 2.805).all()
    assert_allclose(numbers["load_friction"], 0.1, atol=0.03)
    peers = compare_peers(result.evidence, _SETTINGS)
    assert set(peers) == {"least_squares", "semidefinite", "ours"}
    assert peers["ours"]["mass_error"] < 0.05
    figure = draw_masses(*list_weighings(result, weighed, load_weighed_objects(_DATA)))
    assert len(figure.axes) == 3
    assert len(draw_peers(peers).axes) == 2


def test_study_of_injections_and_its_figure(robot):
    rng = np.random.default_rng(5)
    truth = Truth(friction=(0.2, 0.1, 0.1), noise_sd=0.2, agreement=0.5, file_error=0.05)
    empty = generate_run(robot, None, truth=truth, rng=rng, duration=20.0, rate=40.0)
    result = study_panda(PandaData(robot, empty), _SETTINGS, num_injections=3, seed=0)
    assert set(result.numbers) == {"coverage_mass", "rmse_mass_g_5s", "white_coverage_mass_5s"}
    assert set(result.numbers["coverage_mass"]) == {"2", "5", "10"}
    assert result.numbers["coverage_mass"]["5"] >= 0.5
    # White noise claims far more than it should.
    assert np.median(result.control.sd[:, 0]) < 0.3 * np.median(result.injections[5].sd[:, 0])
    assert len(draw_injections(result).axes) == 2


def test_simulated_truths_are_covered(robot):
    run = generate_run(robot, None, truth=Truth(), rng=np.random.default_rng(6))
    prepared = prepare(run, _SETTINGS)
    found = measure_coverage(World(robot, prepared, np.full(6, 0.2), _SETTINGS), num_draws=12, seed=0)
    assert set(found) == {"prior_coverage", "hidden_part_com_coverage"}
    assert set(found["prior_coverage"]) == {"mass", "com", "inertia"}
    assert all(coverage > 0.6 for coverage in (*found["prior_coverage"].values(), found["hidden_part_com_coverage"]))


def test_peers_find_a_payload_without_noise_and_one_is_always_possible(robot):
    rng = np.random.default_rng(7)
    still = Truth(friction=(0.3, 0.1, 0.2), noise_sd=0.0)
    empty, loaded = (generate_run(robot, pi, truth=still, rng=rng) for pi in (None, PAYLOAD))
    gains = build_nominal_gains(robot.joint_names, SignalKind.JOINT_TORQUE, _SETTINGS)
    evidence = pair_runs(robot, empty, loaded, _SETTINGS)
    for solve in (solve_least_squares, solve_semidefinite):
        assert_allclose(solve(evidence, gains).parameters, PAYLOAD, rtol=0.02, atol=2e-3)
    noisy = [generate_run(robot, pi, truth=Truth(noise_sd=1.0), rng=rng) for pi in (None, 0.05 * PAYLOAD)]
    evidence = pair_runs(robot, *noisy, _SETTINGS)
    smallest = [
        np.linalg.eigvalsh(pseudo_inertia_from_parameters(solve(evidence, gains).parameters))[0]
        for solve in (solve_least_squares, solve_semidefinite)
    ]
    assert smallest[0] < -1e-3
    assert smallest[1] > -1e-6


def test_random_payloads_are_possible_and_weigh_what_was_drawn():
    rng = np.random.default_rng(8)
    payloads = [draw_payload(rng, (0.1, 3.0)) for _ in range(50)]
    masses = np.array([payload.parameters[0] for payload in payloads])
    assert is_possible(np.array([payload.parameters for payload in payloads])).all()
    assert 0.07 < masses.min() < masses.max() < 4.0
    centres = np.array([payload.parameters[1:4] / payload.parameters[0] for payload in payloads])
    low, high = (np.array([getattr(payload, name) for payload in payloads]) for name in ("low", "high"))
    assert ((low < centres) & (centres < high)).all()


def test_the_panda_of_the_study_has_seven_joints_and_weighs_what_it_should():
    panda = load_robot(Path(clones.__file__).with_name("panda.urdf"), "panda_link8")
    assert panda.joint_names == tuple(f"panda_joint{k}" for k in range(1, 8))
    assert panda.link_parameters[:, 0].sum() == pytest.approx(16.06, abs=0.01)


def test_a_missing_clone_is_named_before_anything_is_run(tmp_path):
    words = ("--data", tmp_path, "--out", tmp_path / "results")
    said = refuse(run_study, STUDY, *words)
    assert "ur10e.urdf: is missing; --data must contain clones" in said
    assert "of dynamic_calib" in said
    assert not (tmp_path / "results").exists()
    assert "--repeats: is 0, must be from 1 to 100000" in refuse(run_study, STUDY, *words, "--draws", 0)
