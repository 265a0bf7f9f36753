import numpy as np
import pytest
from helpers.figure_checks import LONG_NAMES, assert_all_is_on_the_figure

from affordance.experiments.shared.blow_drawings import draw_blow, draw_renderings
from affordance.plant.nail import NailRecord


def test_photographs_stand_in_rows_by_grip_under_their_titles(rng):
    rows = {
        grip: [rng.integers(0, 255, (20, width, 3), dtype=np.uint8) for width in (40, 40, 20)] for grip in ("a", "b")
    }
    figure = draw_renderings(rows, titles=["start", "strike", "nail"])
    axes = np.reshape(figure.axes, (2, 3))
    assert [each.get_title() for each in axes[0]] == ["start", "strike", "nail"]
    assert [each.get_ylabel() for each in axes[:, 0]] == ["a", "b"]
    for row, pictures in zip(axes, rows.values(), strict=True):
        for each, picture in zip(row, pictures, strict=True):
            np.testing.assert_array_equal(each.get_images()[0].get_array(), picture)


def test_long_names_leave_room_for_the_pictures(rng, tmp_path):
    rows = {name: [rng.integers(0, 255, (38, 100, 3), dtype=np.uint8)] * 3 for name in LONG_NAMES}
    figure = draw_renderings(rows, titles=["start", "strike", "nail"])
    assert_all_is_on_the_figure(figure, tmp_path)
    assert figure.axes[0].get_window_extent().width > 0.2 * figure.bbox.width


@pytest.fixture
def records():
    """Two nails that are struck at 0.8 and at 0.9 s, and come to rest after 6 and 4 ms."""
    records = {}
    for grip, start, duration in (("held by wood", 0.8, 6e-3), ("held by steel", 0.9, 4e-3)):
        times = np.linspace(start - 0.1, start + 0.1, 2001)
        share = np.clip((times - start) / duration, 0.0, 1.0)
        force = np.where((share > 0.0) & (share < 1.0), 400.0 * share, 0.0)
        contact = force + 1000.0 * ((times > start) & (times < start + 2e-4))
        records[grip] = NailRecord(times, 0.012 * share, np.zeros(2001), force, contact)
    return records


def test_blows_are_drawn_from_the_first_touch_in_millimetres_and_milliseconds(records):
    forces, travel = draw_blow(records, force_demanded=427.0).axes
    lines = {line.get_label(): line for line in forces.get_lines()}
    wood, steel = (
        lines[f"resistance of the nail, {grip} (peak {record.resistance.max():.0f} N)"]
        for grip, record in records.items()
    )
    for line, duration in ((wood, 6.0), (steel, 4.0)):
        pushed = line.get_xdata()[line.get_ydata() > 0.0]
        assert pushed[0] == pytest.approx(0.0, abs=0.11)
        assert pushed[-1] == pytest.approx(duration, abs=0.21)
    assert wood.get_color() != steel.get_color()
    assert wood.get_linestyle() != steel.get_linestyle()
    demanded = lines["required peak (427 N)"]
    assert (demanded.get_ydata()[0], demanded.get_linestyle()) == (427.0, ":")
    assert max(line.get_ydata().max() for line in travel.get_lines()) == pytest.approx(12.0)
    # The axes show all of both blows and little more; the contact's peak lies outside and is stated in the legend.
    assert forces.get_xlim()[0] < 0.0
    assert 6.0 < forces.get_xlim()[1] < 12.0
    assert forces.get_ylim()[1] < 1000.0
    assert any(label.startswith("contact with the tool, held by wood (peak 1") for label in lines)


def test_peak_is_said_to_be_cut_off_where_it_is(records):
    assert "cut off" in draw_blow(records, force_demanded=427.0).axes[0].get_title()
    seen = {grip: record._replace(contact=record.resistance) for grip, record in records.items()}
    assert draw_blow(seen, force_demanded=427.0).axes[0].get_title() == "Forces on the nail"


def test_any_number_of_grips_is_drawn_and_told_apart(records):
    (record, _) = records.values()
    grips = [f"held by {k}" for k in range(7)]
    _, travel = draw_blow(dict.fromkeys(grips, record), force_demanded=427.0).axes
    assert len({(line.get_color(), line.get_linestyle()) for line in travel.get_lines()}) == len(grips)
