"""Map of the grip that needs less work."""

import numpy as np
import pytest
from helpers.figure_checks import LONG_NAMES, assert_all_is_on_the_figure
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from affordance.reporting.figures import OBJECT_COLOURS, save_figure
from studies.hammering.figure import draw_map

FORCES, DENSITIES = np.array([100.0, 200.0, 300.0, 400.0]), np.array([1000.0, 5000.0, 9000.0])
# The grip by wood is dearer at 100 N, and twice as cheap at 300 N.
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
    """Values drawn in every cell, by label; the mesh without a label is the ratio."""
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


@pytest.mark.usefixtures("fine")
@pytest.mark.parametrize("can", [True, False])
def test_map_without_a_crossover_is_drawn_without_a_contour(tmp_path, can):
    feasible = {name: np.full((3, 4), can) for name in WORK}
    work = {"hold by wood": np.full((3, 4), 20.0), "hold by steel": np.full((3, 4), 21.0 if can else np.inf)}
    figure = draw_the_map(work=work, feasible=feasible)
    assert not [each for each in figure.axes[0].collections if hasattr(each, "levels")]
    save_figure(figure, tmp_path, "map")
    assert imread(tmp_path / "map.png").shape[1] >= 1500


def test_long_names_have_room_on_the_map(tmp_path):
    work, feasible = (dict(zip(LONG_NAMES, each.values(), strict=True)) for each in (WORK, FEASIBLE))
    label = "density of the extraordinarily_heavy_tungsten_alloy part (kg/m³)"
    figure = draw_the_map(work=work, feasible=feasible, value_label=label, title=f"Work of {LONG_NAMES[0]} with it")
    assert_all_is_on_the_figure(figure, tmp_path)
    assert figure.axes[0].get_window_extent().height > 0.4 * figure.bbox.height
