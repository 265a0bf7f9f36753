"""Mistakes in the options of ``affordance study`` are refused before a study begins."""

from pathlib import Path

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command

from affordance.files.model_folder import list_studies


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("study robustness --set prior.sd=3", "--set: prior.sd: has no effect here: the sample varies it"),
        ("study people --set learner=density", "--set: learner: has no effect here"),
        ("study people --lowest 0.5", "--lowest: is 0.5, must be above 0 and below --highest, 0.48"),
        ("study people --lowest 0", "--lowest: is 0, must be above 0"),
        ("study people --count 2", "--count: is 2, must be at least 3"),
        ("study people --repeats 1", "--repeats: is 1, must be at least 2"),
        ("study payload --repeats 0", "--repeats: is 0, must be from 1 to 100000"),
        ("study payload --only pandas", "--only: is 'pandas', must be one of panda, ur, ur_half, ur_twice, "),
        ("study payload --jobs -2", "--jobs: is -2, must be from 1 to "),
        ("study payload --seed -1", "--seed: is -1, must be from 0 to 4294967295"),
        ("study people --set prior.mode=-7", "settings: prior.mode: is -7, must be from 0 to 25000"),
    ],
)
def test_mistake_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command(*words.split())


def test_studies_are_listed_within_the_width_of_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    known = answer("study", "--json").content
    assert list(known) == list_studies()
    monkeypatch.setattr("affordance.commands.study.find_width", lambda: 80)
    lines = answer("study").lines
    assert max(map(len, lines)) <= 80
    assert all(any(line.startswith(f"  affordance study {name} ") for line in lines) for name in known)
