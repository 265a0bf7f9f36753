"""Settings by name: every one is listed with its source, changed by name, and refused with its bound."""

import dataclasses

import pytest
from helpers.refusals import refuse

from affordance.belief.learners import KINDS_MAP
from affordance.exceptions import BadValueError
from affordance.named_settings import change_settings, describe_changes, list_settings, parse_changes, parse_value
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.settings import DEFAULT_SETTINGS, Settings

NAMES = {each.name: each for each in list_settings()}


def list_leaves(holder, prefix=""):
    """Paths of all fields, found without the annotations."""
    for field in dataclasses.fields(holder):
        value = getattr(holder, field.name)
        if dataclasses.is_dataclass(value):
            yield from list_leaves(value, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}"


def test_every_field_has_a_name_but_the_arm():
    assert {*NAMES} == {*list_leaves(DEFAULT_SETTINGS), "noise.model"} - {"arm", "eye"}


@pytest.mark.parametrize("name", NAMES)
def test_every_setting_says_source_meaning_and_unit(name):
    setting = NAMES[name]
    assert setting.source
    assert setting.meaning.endswith(".")
    assert bool(setting.unit) == (
        (not isinstance(setting.value, str | bool) and setting.value is not None) or "period" in name
    )


@pytest.mark.parametrize("model", ["grey", ["weber"], 3])
def test_an_unknown_noise_model_is_refused(model):
    with pytest.raises(BadValueError, match=r"noise\.model: is .*, must be one of weber, white"):
        change_settings(Settings(), {"noise.model": model})


def test_words_change_what_they_name_and_nothing_else():
    words = ["prior.sd=8e3", "learner=kinds_map", "mpc.num_steps=24", "posterior_log_period=0.5"]
    changed = change_settings(DEFAULT_SETTINGS, parse_changes(words))
    expected = dataclasses.replace(
        DEFAULT_SETTINGS,
        prior=dataclasses.replace(DEFAULT_SETTINGS.prior, sd=8000.0),
        learner=KINDS_MAP,
        mpc=dataclasses.replace(DEFAULT_SETTINGS.mpc, num_steps=24),
        posterior_log_period=0.5,
    )
    assert changed == expected
    values = {"prior.sd": 8000.0, "learner": "kinds_map", "mpc.num_steps": 24, "posterior_log_period": 0.5}
    assert describe_changes(changed) == values
    assert describe_changes(DEFAULT_SETTINGS) == {}


def test_mappings_name_what_lies_below_them():
    dotted = change_settings(DEFAULT_SETTINGS, {"noise.threshold": 0.2, "prior.sd": 5000.0})
    assert change_settings(DEFAULT_SETTINGS, {"noise": {"threshold": 0.2}, "prior": {"sd": 5000.0}}) == dotted
    assert dotted.noise == WeberNoise(threshold=0.2)


def test_model_of_the_noise_comes_before_its_numbers():
    changed = change_settings(DEFAULT_SETTINGS, {"noise.sd": 0.1, "noise.model": "white"})
    assert changed.noise == WhiteNoise(0.1)
    assert change_settings(changed, {"noise.model": "white"}) == changed


def test_values_are_read_as_in_yaml():
    values = {"8e3": 8000.0, "3": 3, "true": True, "null": None, "density": "density", "1.5": 1.5}
    assert {text: parse_value(text) for text in values} == values


def test_texts_of_choices_and_paths_serve_in_python_too(tmp_path):
    settings = Settings(learner="kinds_map", arm=str(tmp_path / "arm.dmd.yaml"))
    assert settings.learner is KINDS_MAP
    assert settings.arm == tmp_path / "arm.dmd.yaml"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"learner": "kinds"}, "Settings: learner: is 'kinds', must be one of density, kinds_map, kinds_drawn"),
        ({"control_period": float("nan")}, "Settings: control_period: is nan, must be from 0.0001 to 0.1"),
        ({"noise": WeberNoise(0.0, 0.0)}, "Settings: noise.threshold: is 0, must be more than 0"),
        ({"noise": 0.1}, "Settings: noise: is 0.1, must be a NoiseModel"),
        ({"prior": 1000.0}, "Settings: prior: is 1000.0, must be a Prior"),
        ({"arm": 3}, "Settings: arm: is 3, must be a path"),
    ],
)
def test_settings_are_checked_when_they_are_made(changes, message):
    with pytest.raises(ValueError, match=r"^Settings: ") as caught:
        Settings(**changes)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("prior.sb=1", "settings: prior.sb: is 'prior.sb', must be one of prior.mode, prior.sd, prior.deviation;"),
        ("priro.sd=1", "settings: priro.sd: is not a setting; did you mean 'prior.sd'?"),
        ("prior=1", "settings: prior: is 'prior', must be one of prior.mode"),
        ("noise.sd=1", "settings: noise.sd: is 'noise.sd', must be one of noise.model, noise.weber_fraction"),
        ("noise.model=pink", "settings: noise.model: is 'pink', must be one of weber, white"),
        ("noise.weber_fraction=-0.1", "settings: noise.weber_fraction: is -0.1, must be from 0 to 1"),
        ("noise.threshold=0", "settings: noise.threshold: is 0, must be more than 0"),
        ("prior.sd=.nan", "settings: prior.sd: is nan, must be from 0.001 to 1e+12"),
        ("prior.sd=much", "settings: prior.sd: is 'much', must be a number"),
        ("mpc.num_steps=2.5", "settings: mpc.num_steps: is 2.5, must be a whole number"),
        ("learner=kind_map", "must be one of density, kinds_map, kinds_drawn; did you mean 'kinds_map'?"),
        ("uses_posterior=1", "settings: uses_posterior: is 1, must be true or false"),
        ("integrator.scheme=radau9", "settings: integrator.scheme: is 'radau9', must be one of "),
        ("integrator.accuracy=7", "settings: integrator.accuracy: is 7, must be from 1e-11 to 1"),
        ("sample_period=0", "settings: sample_period: is 0, must be from 0.0001 to 60"),
        ("prior.sd", "--set: is 'prior.sd', must be NAME=VALUE"),
        ("=3", "--set: is '=3', must be NAME=VALUE"),
    ],
)
def test_mistake_in_a_setting_is_refused(word, said):
    assert said in refuse(lambda: change_settings(DEFAULT_SETTINGS, parse_changes([word])))
