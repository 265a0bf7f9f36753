"""A quarter of the mistakes, in a generated pair; the study makes all of them in a recorded one."""

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, build_robot, generate_run

from affordance.identification.settings import IdentificationSettings
from studies.recorded.mistake_outcomes import Case, Mistake, count_outcomes, try_mistakes
from studies.recorded.mistakes import MISTAKES

_SETTINGS = IdentificationSettings(num_samples=200)


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    robot = build_robot(tmp_path_factory.mktemp("robot"))
    rng = np.random.default_rng(3)
    empty, loaded = (
        generate_run(robot, pi, truth=Truth(noise_sd=0.1), rng=rng, rate=50.0, duration=15.0, source=name)
        for name, pi in (("empty", None), ("loaded", 2.0 * PAYLOAD))
    )
    return Case(robot, empty, loaded, 2.0 * PAYLOAD[0])


def test_mistakes_that_can_be_seen_are_seen_or_do_no_harm(case):
    tried = MISTAKES[::4]
    outcomes = try_mistakes(case, tried, _SETTINGS)
    silent = [outcome.name for outcome in outcomes if outcome.verdict == "wrong_silent"]
    assert not set(silent) & {mistake.name for mistake in tried if mistake.can_be_seen}
    counts = count_outcomes(outcomes)
    assert counts.pop("tried") == sum(counts.values()) == len(tried)
    assert counts["refused"] > 3
    assert counts["not_trusted"] > 8


def test_what_no_recording_can_show_is_answered_and_stands_among_the_assumptions(case):
    unseen = [mistake for mistake in MISTAKES if not mistake.can_be_seen and "weighed" not in mistake.name]
    assert [outcome.verdict for outcome in try_mistakes(case, unseen, _SETTINGS)] == ["wrong_silent"] * len(unseen)
    assumed = " ".join(case.identify(_SETTINGS).assumptions)
    assert "the payload is attached at flange" in assumed
    assert "a gripper missing from them counts as payload" in assumed


def test_a_good_case_is_right(case):
    outcome = try_mistakes(case, [Mistake("none", lambda good: good)], _SETTINGS)[0]
    assert outcome == ("none", "right", "")


def test_there_are_mistakes_of_every_kind():
    assert len(MISTAKES) == len({mistake.name for mistake in MISTAKES}) >= 60
