"""Time course within the first trial of Simulation I."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.results_files import OF_STUDY, read_numbers

from studies.within_trial.study import BY_POSTERIOR, BY_PRIOR, EVERY_SAMPLE, ONE_PERCEPT, WithinTrialStudy


@pytest.fixture(scope="module")
def study(weight):
    return WithinTrialStudy(weight.settings, weight.tools[0], duration=2.0, seed=(0, 0, 0))


def test_measured_growth_is_that_of_the_theory_once_the_arm_rests(study):
    numbers = study.summarise()
    for noise in (ONE_PERCEPT, EVERY_SAMPLE):
        found, theory = (numbers[key][noise] for key in ("posterior_sd", "posterior_sd_at_rest"))
        assert len(found) == len(theory) == 22
        np.testing.assert_allclose(found[-5:], theory[-5:], rtol=0.05)
        assert found[0] == pytest.approx(theory[0])
    white, percept = (numbers["posterior_sd"][noise] for noise in (EVERY_SAMPLE, ONE_PERCEPT))
    assert (np.diff(white[1:-1]) < 0.0).all()
    assert white[-1] < 0.6 * percept[-1]
    assert np.ptp(percept[4:]) < 0.1 * percept[-1]


def test_arm_sinks_and_comes_back_only_if_control_uses_the_posterior(study):
    numbers = study.summarise()
    lowest, end = numbers["height_lowest_m"], numbers["height_end_m"]
    assert max(lowest[BY_PRIOR], end[BY_PRIOR]) < -0.1
    assert lowest[BY_POSTERIOR] < -0.02
    assert abs(end[BY_POSTERIOR]) < 0.1 * abs(lowest[BY_POSTERIOR])


def test_figures_show_what_was_found(study):
    found = study.run()
    growth, sinking = study.draw_growth(), study.draw_sinking()
    _, right = growth.axes
    drawn = {line.get_label(): line for line in right.lines}
    np.testing.assert_array_equal(drawn[ONE_PERCEPT].get_ydata(), found.growth[ONE_PERCEPT].sd)
    left, believed = sinking.axes
    assert [line.get_label().split(":")[0] for line in left.lines[1:]] == [
        f"control by {belief}" for belief in (BY_PRIOR, BY_POSTERIOR)
    ]
    np.testing.assert_allclose(left.lines[1].get_ydata(), 100.0 * found.records[BY_PRIOR].height_centre)
    of_prior, of_posterior = (line.get_ydata() for line in believed.lines[1:])
    assert np.ptp(of_prior) == 0.0
    assert of_posterior[-1] > 7000.0


def test_command_writes_section_and_numbers(tmp_path):
    answer("study", "within_trial", "--out", tmp_path, "--set", "posterior_log_period=0.5")
    numbers = read_numbers(tmp_path / "within_trial")
    found = {"posterior_sd", "posterior_sd_at_rest", "height_lowest_m", "height_end_m", "seed"}
    assert numbers.keys() - OF_STUDY == found
    assert all(len(values) == 32 for values in numbers["posterior_sd"].values())
    section = json.loads((tmp_path / "within_trial" / "section.json").read_text(encoding="utf-8"))
    assert [figure["file"] for figure in section["figures"]] == ["posterior.png", "sinking.png"]
    assert all((tmp_path / "within_trial" / each["file"]).stat().st_size > 10_000 for each in section["figures"])
    assert "rod 10cm" in section["summary"]
