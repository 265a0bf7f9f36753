import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from matplotlib.text import Text

from affordance.plant.nail import NailRecord
from affordance.reporting.blow_figures import draw_blow, draw_map, draw_renderings
from affordance.reporting.figures import OBJECT_COLOURS, save_figure


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


LONG_NAMES = [f"held by _{end}_end_of_an_extraordinarily_long_painted_handle" for end in ("upper", "lower")]


def test_long_names_leave_room_for_the_pictures(rng, tmp_path):
    rows = {name: [rng.integers(0, 255, (38, 100, 3), dtype=np.uint8)] * 3 for name in LONG_NAMES}
    figure = draw_renderings(rows, titles=["start", "strike", "nail"])
    assert_all_is_on_the_figure(figure, tmp_path)
    assert figure.axes[0].get_window_extent().width > 0.2 * figure.bbox.width


def test_long_names_have_room_on_the_map(tmp_path):
    work, feasible = (dict(zip(LONG_NAMES, each.values(), strict=True)) for each in (WORK, FEASIBLE))
    label = "density of the extraordinarily_heavy_tungsten_alloy part (kg/m³)"
    figure = draw_the_map(work=work, feasible=feasible, value_label=label, title=f"Work of {LONG_NAMES[0]} with it")
    assert_all_is_on_the_figure(figure, tmp_path)
    assert figure.axes[0].get_window_extent().height > 0.4 * figure.bbox.height


def assert_all_is_on_the_figure(figure, folder):
    save_figure(figure, folder, "a")
    figure.draw_without_rendering()
    for text in figure.findobj(Text):
        if text.get_text() and text.get_visible():
            box = text.get_window_extent()
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, text
            assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1, text


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
    demanded = lines["demanded peak (427 N)"]
    assert (demanded.get_ydata()[0], demanded.get_linestyle()) == (427.0, ":")
    assert max(line.get_ydata().max() for line in travel.get_lines()) == pytest.approx(12.0)
    # All of both blows is seen, and not much more; the contact's peak is said, for it is not seen.
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


FORCES, DENSITIES = np.array([100.0, 200.0, 300.0, 400.0]), np.array([1000.0, 5000.0, 9000.0])
# By wood is dearer at 100 N, and twice as cheap at 300 N.
WORK = {
    "hold by wood": np.tile([30.0, 20.0, 20.0, np.inf], (3, 1)),
    "hold by steel": np.tile([20.0, 25, 40, 50], (3, 1)),
}
FEASIBLE = {name: np.ones((3, 4), dtype=bool) for name in WORK}
FEASIBLE["hold by wood"][:, 3] = FEASIBLE["hold by wood"][0, 2] = False
FEASIBLE["hold by steel"][2, 2:] = False


def draw_the_map(**changes):
    arguments = {
        "forces": FORCES,
        "values": DENSITIES,
        "work": WORK,
        "feasible": FEASIBLE,
        "case": (250.0, 7850.0),
        "case_label": "the paper's",
        "value_label": "density (kg/m³)",
        "title": "Map",
    }
    return draw_map(**(arguments | changes))


def get_cells(axes):
    """What is drawn in every cell, by label; the ratio has none."""
    cells = {}
    for collection in axes.collections:
        if collection.get_array() is not None and collection.get_array().size == 12:
            label = "ratio" if isinstance(collection, QuadMesh) else collection.get_label()
            cells[label] = np.ma.masked_invalid(np.ma.asarray(collection.get_array())).reshape(3, 4)
    return cells


def test_map_marks_the_right_cells():
    axes, _ = draw_the_map().axes
    cells = get_cells(axes)
    both, neither = FEASIBLE["hold by wood"] & FEASIBLE["hold by steel"], np.zeros((3, 4), dtype=bool)
    neither[2, 3] = True
    only_wood, only_steel = np.zeros((2, 3, 4), dtype=bool)
    only_wood[2, 2] = only_steel[:2, 3] = only_steel[0, 2] = True
    for label, where in (
        ("ratio", both),
        ("only possible: hold by wood", only_wood),
        ("only possible: hold by steel", only_steel),
        ("neither possible", neither),
    ):
        np.testing.assert_array_equal(~np.ma.getmaskarray(cells[label]), where, err_msg=label)
    np.testing.assert_allclose(np.exp(cells["ratio"][1, :3].data), [20 / 30, 25 / 20, 2.0])


def test_colours_of_the_map_are_those_of_the_cheaper_grip_and_the_same_to_either_side():
    axes, bar = draw_the_map().axes
    (ratio,) = (each for each in axes.collections if isinstance(each, QuadMesh))
    low, high = ratio.get_clim()
    assert low == -high
    assert high == pytest.approx(np.log(2.0))
    np.testing.assert_allclose(ratio.cmap(1.0)[:3], to_rgb(OBJECT_COLOURS[0]))
    np.testing.assert_allclose(ratio.cmap(0.0)[:3], to_rgb(OBJECT_COLOURS[2]))
    assert bar.get_title() == "hold by wood\ncheaper"
    assert bar.get_xlabel() == "hold by steel\ncheaper"
    assert [control_period.get_text() for control_period in bar.get_yticklabels()] == ["2", "1.2", "1", "1.2", "2"]


def test_contour_of_the_map_is_where_both_cost_the_same_and_the_case_is_marked():
    axes, _ = draw_the_map().axes
    (contour,) = (each for each in axes.collections if hasattr(each, "levels"))
    (path,) = (path for path in contour.get_paths() if len(path))
    x = 100.0 + 100.0 * np.log(1.5) / np.log(1.5 * 1.25)  # linear in the logarithm between two cells
    np.testing.assert_allclose(path.vertices[:, 0], x, atol=0.1)
    (star,) = (line for line in axes.get_lines() if line.get_marker() == "*")
    assert (star.get_xdata()[0], star.get_ydata()[0]) == (250.0, 7850.0)
    assert "the paper's" in [text.get_text() for text in axes.texts]


@pytest.mark.parametrize("case", [(250.0, 7850.0), (250.0, 8800.0), (390.0, 8900.0), (110.0, 1100.0)])
def test_name_of_the_case_stays_on_the_map(tmp_path, case):
    figure = draw_the_map(case=case, case_label="simulation IV")
    save_figure(figure, tmp_path, "map")
    axes = figure.axes[0]
    (label,) = (text for text in axes.texts if text.get_text() == "simulation IV")
    name, room = label.get_window_extent(), axes.get_window_extent()
    assert room.x0 <= name.x0 < name.x1 <= room.x1
    assert room.y0 <= name.y0 < name.y1 <= room.y1


@pytest.mark.parametrize("can", [True, False])
def test_map_without_a_crossover_is_drawn_without_a_contour(tmp_path, can):
    feasible = {name: np.full((3, 4), can) for name in WORK}
    work = {"hold by wood": np.full((3, 4), 20.0), "hold by steel": np.full((3, 4), 21.0 if can else np.inf)}
    figure = draw_the_map(work=work, feasible=feasible)
    assert not [each for each in figure.axes[0].collections if hasattr(each, "levels")]
    save_figure(figure, tmp_path, "map")
    assert imread(tmp_path / "map.png").shape[1] >= 1500
