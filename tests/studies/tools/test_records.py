"""Force-torque records, made up with the sign and the noise of the data set's."""

import pickle

import numpy as np
import pytest
from helpers.generated_records import record_tool
from helpers.refusals import refuse
from helpers.workshop import HAMMERS

from affordance.objects.inertia import build_inertia_map
from affordance.settings import Settings
from studies.tools.data_set import TrueInertia, compare_inertia, compute_central_inertia
from studies.tools.record_file import read_pickle, read_recording
from studies.tools.record_methods import (
    NOISES,
    PointParts,
    add_noise,
    build_regressors,
    infer_densities,
    solve_at_rest,
    solve_least_squares,
)

TOOL = HAMMERS["claw hammer"]
PI = TOOL.parameters
PHI = build_inertia_map([p.shape for p in TOOL.components], [p.X_TE for p in TOOL.components], [0, 1], 2)
RHO = np.array([part.material.density for part in TOOL.components])


@pytest.fixture
def recording(rng):
    return record_tool(PI, rng)


def test_exact_record_gives_exact_parameters(recording, rng):
    measured = add_noise(recording, NOISES["none"], rng)
    np.testing.assert_allclose(build_regressors(measured) @ PI, measured.wrench_S, atol=1e-9)
    np.testing.assert_allclose(solve_least_squares(measured), PI, atol=1e-9)
    belief = infer_densities(measured, PHI, NOISES["none"], Settings().prior)
    np.testing.assert_allclose(belief.compute_mean(), RHO, rtol=1e-3)


def test_sign_of_gravity_matters(recording, rng):
    """A real sensor's m (a - g), read with the sign of these records, makes the mass wrong by more than half."""
    weight = PI[0] * np.array([0, 0, -9.81])
    r = np.einsum("nij,j->ni", recording.X_WS[:, :3, :3], PI[1:4] / PI[0])
    real = recording._replace(
        force_W=recording.force_W - 2.0 * weight, torque_W=recording.torque_W - 2.0 * np.cross(r, weight)
    )
    measured = add_noise(real, NOISES["none"], rng)
    pi = solve_least_squares(measured)
    assert abs(pi[0] / PI[0] - 1.0) > 0.5
    assert np.abs(build_regressors(measured) @ pi - measured.wrench_S).max() > 0.1


def test_noise_is_known_and_intervals_hold_the_truth(recording):
    held = []
    for seed in range(20):
        measured = add_noise(recording, NOISES["high"], np.random.default_rng(seed))
        belief = infer_densities(measured, PHI, NOISES["high"], Settings().prior)
        sd = np.sqrt(np.diag(belief.covariance))
        held.append(np.abs(belief.compute_mean() - RHO) < 1.645 * sd)
        assert abs(PHI[0] @ belief.compute_mean() / PI[0] - 1.0) < 0.05
    assert 0.75 <= np.mean(held) <= 1.0


def test_samples_at_rest_give_part_masses_of_points(recording, rng):
    still = recording._replace(a_WS=0 * recording.a_WS, alpha_WS=0 * recording.a_WS, w_WS=0 * recording.a_WS)
    parts = PointParts(np.array([[0.0, 0, 0], [0.2, 0.05, 0]]), np.array([1e-4, 5e-5]), np.array([0, 1]))
    pi = parts.build_inertia_map() @ [1000.0, 7800.0]
    force = np.tile(pi[0] * np.array([0, 0, -9.81]), (200, 1))
    r = np.einsum("nij,j->ni", still.X_WS[:, :3, :3], pi[1:4] / pi[0])
    still = still._replace(force_W=force, torque_W=np.cross(r, force))
    np.testing.assert_allclose(
        solve_at_rest(add_noise(still, NOISES["none"], rng), parts.build_inertia_map()), pi, atol=1e-9
    )


def test_parity_is_nothing_for_the_truth_itself():
    truth = TrueInertia(TOOL.mass, TOOL.p_TTcm, compute_central_inertia(PI))
    assert max(compare_inertia(TOOL, truth)) < 1e-12
    wrong = TrueInertia(2.0 * TOOL.mass, TOOL.p_TTcm + np.array([0, 0.001, 0]), compute_central_inertia(PI))
    assert compare_inertia(TOOL, wrong) == pytest.approx((0.5, 0.001, 0.0), abs=1e-9)


class Harmful:
    def __reduce__(self):
        return (print, ("a pickle ran this",))


def test_pickles_run_nothing(tmp_path, capsys):
    path = tmp_path / "record.pkl"
    path.write_bytes(pickle.dumps([Harmful()]))
    assert "record.pkl: is not a readable record: it names builtins.print, which no" in refuse(read_pickle, path)
    assert capsys.readouterr().out == ""
    path.write_bytes(pickle.dumps([1.0, "no record"]))
    assert read_pickle(path) == [1.0, "no record"]
    assert "is not a record of forces and torques: a row has no ft_pose" in refuse(read_recording, path)
    path.write_bytes(b"nothing")
    assert "is not a readable record" in refuse(read_pickle, path)
    assert "cannot be read: No such file" in refuse(read_pickle, tmp_path / "none.pkl")
