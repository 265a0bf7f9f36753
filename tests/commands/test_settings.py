"""``affordance settings``, and ``--set`` of every command that uses settings."""

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers

SMALL = ["--repeats", "1", "--jobs", "1"]


def test_settings_are_listed_with_value_unit_and_source():
    out = answer("settings").out
    assert "prior.sd = 4000 kg/m^3\n" in out
    assert "(Ross & Gregory" in out
    assert "noise.model = weber\n" in out
    assert "posterior_log_period = null\n" in out
    assert "faults.stuck_joint = ''\n" in out
    assert "0016-faults-and-\n" not in out


def test_some_are_listed_by_name_with_what_was_set():
    lines = answer("settings", "prior", "--set", "prior.sd=8000").lines
    assert [line for line in lines if not line.startswith(" ")] == [
        "prior.mode = 1000 kg/m^3",
        "prior.sd = 8000 kg/m^3",
        "prior.deviation = 0.06",
    ]
    assert any("Source: --set." in line for line in lines)


@pytest.mark.usefixtures("unrendered")
def test_set_changes_what_is_run_and_stands_in_the_results(tmp_path):
    answer("run", "two_families", *SMALL, "--out", tmp_path, "--set", "noise.weber_fraction=0.13")
    folder = tmp_path / "two_families"
    numbers = read_numbers(folder)
    assert numbers["config"]["settings"]["noise"]["weber_fraction"] == 0.13
    assert numbers["setup"]["settings"] == {"noise.weber_fraction": 0.13}
    assert numbers["setup"]["models"] == "those of the program"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "changed settings: noise.weber_fraction = 0.13;" in page
    assert "<h1>Visual inertial affordances: the paper" not in page
    _, *lifts = (folder / "lifts.csv").read_text().splitlines()
    assert len(lifts) == 3 * 4 * 16  # of each learner, each object and each repetition


def test_unknown_group_is_refused_with_the_nearest():
    assert "did you mean 'prior'?" in refuse_command("settings", "priors")


def test_settings_as_json_have_value_unit_and_source():
    content = answer("settings", "prior", "--set", "prior.sd=8000", "--json").content
    assert list(content) == ["prior.mode", "prior.sd", "prior.deviation"]
    assert content["prior.sd"] | {"meaning": ""} == {
        "value": 8000,
        "unit": "kg/m^3",
        "meaning": "",
        "source": "--set",
    }


def test_lines_of_settings_fit_the_terminal(monkeypatch):
    monkeypatch.setattr("affordance.commands.settings.find_width", lambda: 60)
    assert max(map(len, answer("settings", "prior").lines)) <= 60
