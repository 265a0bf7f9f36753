import json

import pytest

from affordance.experiments.modes import compare_modes, keep_mode
from affordance.settings import DEFAULT_SETTINGS, Settings, Sight

PIXELS = Settings(sight=Sight.PIXELS)


def keep(out, settings, median):
    keep_mode(out / "weight", {"density_median": median, "drop_m": [0.2, 0.01]}, settings)


def test_nothing_is_compared_where_there_is_one_way_of_seeing(tmp_path):
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    compare_modes(tmp_path)
    assert not (tmp_path / "modes").exists()


@pytest.mark.parametrize(("seen", "met"), [([3100.0, 8400.0], True), ([3000.0, 7000.0], False)])
def test_both_ways_of_seeing_stand_side_by_side(tmp_path, seen, met):
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    keep(tmp_path, PIXELS, seen)
    compare_modes(tmp_path)
    section = json.loads((tmp_path / "modes" / "section.json").read_text())
    assert (tmp_path / "modes" / "modes.png").exists()
    (claim,) = section["claims"]
    assert claim["met"] is met
    assert "features 3000 8500" in section["summary"]
