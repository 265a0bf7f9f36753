"""Small versions of the studies of benchmarks/trust that no other test covers."""

import json

import numpy as np
import pytest

from benchmarks.trust import run, scaling, soak


def test_soak_counts_its_trials_and_finds_no_growth():
    found, numbers = soak.measure(trials=100)
    assert found.memory.shape == found.seconds.shape == (soak.NUM_BLOCKS,)
    assert (found.seconds > 0.0).all()
    assert numbers["soak_trials"] == 100
    assert numbers["soak_memory_growth_MB"] < 4.0  # a leak of 50 kB a trial would show as 5 MB


@pytest.mark.parametrize(("num_components", "num_materials"), [(1, 1), (4, 2), (16, 16)])
def test_bar_is_as_long_and_heavy_whatever_it_is_made_of(num_components, num_materials):
    bar = scaling.build_bar(num_components, num_materials)
    assert len(bar.components) == num_components
    assert len({part.looks_like.colour for part in bar.components}) == num_materials
    assert bar.mass == pytest.approx(scaling.build_bar(1, 1).mass)
    np.testing.assert_allclose(bar.p_TTfree, [0.3, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("text", ["", "{", "[1]", "null", "[" * 100_000, '{"kills": 20}'])
def test_file_that_no_study_wrote_is_set_aside(tmp_path, caplog, text):
    path = tmp_path / "soak.json"
    path.write_text(text)
    assert run.read_numbers(tmp_path, "soak") is None
    assert "soak.json is not what a study found" in caplog.text
    assert not path.exists()
    assert (tmp_path / "soak.broken").exists()


@pytest.mark.parametrize("missing", [f"{study}.{key}" for study, keys in run.KEYS.items() for key in keys])
def test_study_without_one_of_its_keys_is_set_aside(tmp_path, caplog, missing):
    study, key = missing.split(".")
    found = dict.fromkeys(run.KEYS[study], 1.0)
    (tmp_path / f"{study}.json").write_text(json.dumps(found))
    assert run.read_numbers(tmp_path, study) == found
    del found[key]
    (tmp_path / f"{study}.json").write_text(json.dumps(found))
    assert run.read_numbers(tmp_path, study) is None
    assert f"{study}.json is not what a study found (it has no {key}); set aside as {study}.broken" in caplog.text


def test_every_study_has_keys():
    assert run.KEYS.keys() == run.STUDIES.keys()


def test_study_that_was_not_run_has_no_numbers(tmp_path):
    assert run.read_numbers(tmp_path, "soak") is None


def test_unknown_study_is_refused(capsys):
    with pytest.raises(SystemExit):
        run.main(["astrology"])
    assert "'astrology' is none of calibration, faults, bad_input" in capsys.readouterr().err
