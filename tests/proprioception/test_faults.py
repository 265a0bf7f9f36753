import dataclasses

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadValueError
from affordance.experiments import com
from affordance.experiments.shared.observers import Setup
from affordance.files.model_folder import MODELS
from affordance.proprioception.faults import NO_FAULTS, Faults, load_faults
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import Observer, TrialRunner

FILE = MODELS / "faults.yaml"
NAMES = ("nan_samples", "dropped_samples", "spikes", "stuck_sensor", "bias", "delay", "heavy_arm")
FELT, SD = np.arange(7.0), np.full(7, 0.5)


def distort(faults, count=4000, stuck=None):
    return np.array([faults.distort(FELT, SD, stuck, (number,)) for number in range(count)])


def run(weight, faults, tool=2, seed=(1,), duration=1.0, **changes):
    settings = dataclasses.replace(weight.settings, faults=faults, **changes)
    return TrialRunner(settings).run_hold(weight.tools[tool], MaterialMemory(), duration=duration, seed=seed)


def assert_frequency(count, total, probability):
    """Asserts that a count is within four and a half standard errors of its binomial expectation."""
    assert abs(count - total * probability) < 4.5 * np.sqrt(total * probability * (1 - probability))


def test_dropped_samples_are_nan_at_every_joint_as_often_as_asked():
    missing = np.isnan(distort(Faults(drop_probability=0.3)))
    assert (missing.all(axis=1) == missing.any(axis=1)).all()
    assert_frequency(missing.all(axis=1).sum(), 4000, 0.3)


def test_nan_samples_are_nan_at_one_joint_any_as_often_as_asked():
    missing = np.isnan(distort(Faults(nan_probability=0.1)))
    assert (missing.sum(axis=1) <= 1).all()
    assert_frequency(missing.sum(), 4000, 0.1)
    assert missing.any(axis=0).all()


def test_spikes_are_uniform_up_to_their_height_at_one_joint():
    added = distort(Faults(spike_probability=0.5, spike_height=20.0)) - FELT
    assert ((added != 0.0).sum(axis=1) <= 1).all()
    spikes = added[added != 0.0]
    assert_frequency(len(spikes), 4000, 0.5)
    assert np.abs(spikes).max() <= 20.0
    assert abs(spikes.mean()) < 4.5 * 20.0 / np.sqrt(3 * len(spikes))
    assert spikes.std() == pytest.approx(20.0 / np.sqrt(3), rel=0.05)


def test_stuck_sensor_reads_one_torque_and_bias_adds_standard_deviations():
    reported = distort(Faults(stuck_joint="elbow", stuck_torque=-3.0, bias_sd=2.0), 2, stuck=4)
    np.testing.assert_array_equal(reported[:, 4], -3.0)
    np.testing.assert_array_equal(np.delete(reported[0] - FELT, 4), 1.0)


def test_sample_that_did_not_arrive_stays_missing_whatever_else_is_wrong():
    felt = np.full(7, np.nan)
    faults = Faults(stuck_joint="elbow", stuck_torque=-3.0, bias_sd=2.0, spike_probability=1.0, spike_height=9.0)
    reported = faults.distort(felt, SD, 4, (0,))
    assert np.isnan(reported).all()
    assert reported is not felt


def test_late_samples_of_a_stuck_sensor_are_missing_before_the_first_arrives(weight):
    samples = run(weight, Faults(stuck_joint="elbow_flexion", delay_samples=2)).samples
    assert (samples.missing, samples.not_finite) == (2, 0)


def test_heavier_arm_is_heavier_in_every_body_and_the_tool_is_not(runner, weight):
    arm = runner.get_diagram(weight.tools[0]).arm
    contexts = [arm.plant.CreateDefaultContext() for _ in range(2)]
    Faults(arm_mass_factor=1.05).change_arm(arm, contexts[1])
    for index in arm.plant.GetBodyIndices(arm.hand.body().model_instance()):
        body = arm.plant.get_body(index)
        before, after = (body.CalcSpatialInertiaInBodyFrame(context).CopyToFullMatrix6() for context in contexts)
        np.testing.assert_allclose(after, 1.05 * before, rtol=1e-12)
    assert arm.tool.get_mass(contexts[0]) == arm.tool.get_mass(contexts[1])


def test_late_torque_is_that_of_the_sample_before(weight):
    """Torques of a drop, felt with the least error and two samples late, are those of two samples before to 6 SDs."""
    settings = dataclasses.replace(weight.settings, noise=WhiteNoise(1e-6))
    seen = {}
    for delay in (0, 2):
        runner = TrialRunner(dataclasses.replace(settings, faults=Faults(delay_samples=delay)))
        estimator = runner.get_diagram()._estimator
        seen[delay] = []
        original = estimator._noise

        class Listening(WhiteNoise):
            def compute_features(self, tau, tau_arm, Y, heard=seen[delay]):
                heard.append(np.array(tau))
                return super().compute_features(tau, tau_arm, Y)

            def compute_sd(self, tau):
                return np.full(len(tau), 100.0)  # so that late torques are not refused as impossible

        estimator._noise = Listening(1.0)  # it draws no errors
        record = runner.run_hold(weight.tools[0], MaterialMemory(), duration=1.0, seed=(0,))
        estimator._noise = original
        assert record.samples.missing == delay
    assert np.ptp(seen[0], axis=0).max() > 0.5
    np.testing.assert_allclose(seen[2], seen[0][:-2], rtol=0, atol=6e-6)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("uses_posterior", [False, True])
def test_arm_keeps_its_limits_and_belief_stays_valid_under(weight, arm, name, uses_posterior):
    limits = arm.limits
    faults = load_faults(FILE, [name], arm.joint_names)
    for tool in (2, 4):
        record = run(weight, faults, tool, uses_posterior=uses_posterior)
        assert np.isfinite(record.q).all()
        assert (record.q >= limits.q_lower).all()
        assert (record.q <= limits.q_upper).all()
        assert (np.abs(record.v) <= limits.v_max).all()
        assert (np.abs(record.tau) <= limits.tau_max).all()
        belief = record.memory.belief
        assert np.linalg.eigvalsh(belief.precision)[0] > 0.0
        percentiles = belief.compute_percentiles([0.01, 0.5, 0.99])
        assert np.isfinite(percentiles).all()
        assert (percentiles > 0.0).all()
        assert sum(record.samples) == 10
        if name in ("stuck_sensor", "bias", "heavy_arm"):
            assert record.samples.rejected == 0


@pytest.mark.parametrize(("margin", "keeps"), [(0.0, False), (DEFAULT_SETTINGS.angle_margin, True)])
def test_margin_keeps_the_elbow_in_its_range_in_the_first_hold_of_simulation_2(margin, keeps):
    """A margin keeps the elbow within its limit for a tool heavier than believed, without faults (decision 0005)."""
    first, *_ = com.read(Setup())
    runner = TrialRunner(dataclasses.replace(DEFAULT_SETTINGS, angle_margin=margin))
    record = runner.run_hold(first, MaterialMemory(), duration=1.0, seed=(0, 0, 0))
    assert (record.q >= runner.get_diagram().arm.limits.q_lower).all() == keeps


def test_refused_samples_are_counted_by_reason(weight):
    assert run(weight, NO_FAULTS).samples == (0, 0, 0, 10)
    assert run(weight, Faults(drop_probability=1.0)).samples == (10, 0, 0, 0)
    assert run(weight, Faults(nan_probability=1.0)).samples == (0, 10, 0, 0)
    spiky = run(weight, Faults(spike_probability=1.0, spike_height=1e4)).samples
    assert spiky.impossible >= 9
    assert spiky.rejected + spiky.accepted == 10


def test_trial_of_which_nothing_was_measured_teaches_nothing_and_is_no_outlier(weight):
    record = run(weight, Faults(drop_probability=1.0))
    prior = weight.settings.prior
    np.testing.assert_allclose(record.memory.belief.untruncated_mean, prior.mode)
    np.testing.assert_allclose(record.memory.belief.covariance, prior.sd**2)
    assert (record.log_evidence, record.p_value, record.is_outlier) == (0.0, 1.0, False)


def test_refused_samples_leave_the_others_what_they_say(weight):
    """A density learned without 30 % of the samples agrees to 0.2 % with all, as errors last for the trial."""
    whole, part = (
        run(weight, Faults(drop_probability=drop), duration=3.0).memory.belief.untruncated_mean[0]
        for drop in (0.0, 0.3)
    )
    assert part == pytest.approx(whole, rel=2e-3)
    assert part != whole


def test_decoy_and_bias_are_outliers_and_an_honest_trial_is_not(weight):
    observer = Observer(TrialRunner(weight.settings), MaterialMemory(), duration=1.0)
    records = [observer.hold(tool, (trial,)) for trial, tool in enumerate(weight.tools)]
    assert [record.is_outlier for record in records] == [False] * 4 + [True]
    assert run(weight, Faults(bias_sd=3.0)).p_value < OUTLIER_P_VALUE
    assert run(weight, NO_FAULTS).p_value > 0.001


def test_outlier_teaches_or_does_not_as_the_settings_say(weight):
    faults = Faults(bias_sd=5.0)
    teaching, refused = (run(weight, faults, learns_from_outliers=learns) for learns in (True, False))
    assert teaching.is_outlier
    assert refused.is_outlier
    assert refused.memory.colours == ()
    assert teaching.memory.belief.size == 1
    honest, careful = (run(weight, NO_FAULTS, learns_from_outliers=learns) for learns in (True, False))
    np.testing.assert_array_equal(honest.memory.belief.information_vector, careful.memory.belief.information_vector)


def test_faults_are_read_and_put_together(arm):
    assert load_faults(FILE, [], arm.joint_names) == NO_FAULTS
    together = load_faults(FILE, ["bias", "dropped_samples", "bias"], arm.joint_names)
    assert together == Faults(bias_sd=3.0, drop_probability=0.3)
    assert load_faults(FILE, ["delay"], arm.joint_names).delay_samples == 1
    assert load_faults(FILE, ["stuck_sensor"], arm.joint_names).find_stuck(arm.joint_names) == 1


def test_stuck_joint_the_arm_has_not_is_refused(arm):
    with pytest.raises(BadValueError, match="faults: stuck_joint: is 'knee', must be one of shoulder_azimuth"):
        Faults(stuck_joint="knee").find_stuck(arm.joint_names)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: {drop_probability: 1.5}", "a.drop_probability: is 1.5, must be from 0 to 1"),
        ("a: {delay_samples: 0.5}", "a.delay_samples: is 0.5, must be a whole number"),
        ("a: {stuck_joint: knee}", "a.stuck_joint: is 'knee', must be one of shoulder_azimuth"),
        ("a: {arm_mass_factor: 0}", "a.arm_mass_factor: is 0, must be from 0.5 to 2"),
        ("a: {bais_sd: 3}", "a.bais_sd: is not a key known here"),
        ("b: {bias_sd: 3}", "--fault: is 'a', must be one of b"),
        ("a: {bias_sd: 3}\nb: {bias_sd: 1}", "--fault: 'b' sets bias_sd, which another fault already sets"),
    ],
)
def test_mistake_in_a_fault_is_refused(arm, tmp_path, text, said):
    (tmp_path / "faults.yaml").write_text(text)
    assert said in refuse(load_faults, tmp_path / "faults.yaml", ["a", "b"], arm.joint_names)
