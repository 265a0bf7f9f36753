import itertools

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from affordance.reporting.figures import (
    draw_choices,
    draw_density_and_drop,
    draw_heights,
    draw_heights_of_points,
    draw_paths,
    prepare_figure,
    save_figure,
)
from affordance.reporting.statistics import estimate_mean

QUARTILES = np.array(
    [[1500, 3100, 5200], [7500, 8200, 8900], [8100, 8500, 8900], [8100, 8400, 8700], [8200, 8450, 8700]]
)


def draw_figure3():
    return draw_density_and_drop(
        quartiles=QUARTILES,
        mode=QUARTILES[:, 1],
        density_true=8500.0,
        drop=estimate_mean(np.abs(np.random.default_rng(0).normal(size=(10, 4)))),
        masses=np.array([0.4, 0.6, 0.8, 1.0]),
        num_repeats=10,
    )


def test_density_is_drawn_as_given():
    left, right, _ = draw_figure3().axes
    lines = {line.get_label(): line for line in left.get_lines()}
    np.testing.assert_array_equal(lines["median of the belief"].get_ydata(), [3100, 8200, 8500, 8400, 8450])
    assert lines["true density"].get_ydata()[0] == 8500.0
    assert "kg/m³" in left.get_ylabel()
    assert "cm" in right.get_ylabel()
    assert len(right.patches) == 4


def test_drops_after_the_first_are_seen_beside_it():
    """A drop of 0.2 cm beside one of 20 cm fills more than half of its panel, in both scales the same numbers."""
    drops = estimate_mean(np.tile([0.2, 0.002, 0.0015, 0.001], (5, 1)))
    figure = draw_density_and_drop(
        quartiles=QUARTILES,
        mode=QUARTILES[:, 1],
        density_true=8500.0,
        drop=drops,
        masses=np.array([0.4, 0.6, 0.8, 1.0]),
        num_repeats=5,
    )
    _, every, near = figure.axes
    heights = [[bar.get_height() for bar in axes.patches] for axes in (every, near)]
    np.testing.assert_allclose(heights[0], 100.0 * drops.mean)
    np.testing.assert_allclose(heights[1], 100.0 * drops.mean[1:])
    assert heights[1][0] > 0.5 * near.get_ylim()[1]
    assert [text.get_text().split("\n")[0] for text in near.get_xticklabels()] == ["2", "3", "4"]


def draw_heights_of(heights, labels):
    """Draws heights of observers, (repeats, K, 31), [m]; the first observer is shown."""
    return draw_heights(
        times=np.linspace(0, 3, 31),
        shown=heights[0],
        mean=estimate_mean(heights),
        labels=labels,
        shown_label="seed 0",
        num_repeats=len(heights),
    )


def test_heights_are_drawn_in_centimetres_with_the_decoy_last(rng):
    heights = rng.normal(size=(6, 3, 31)) * 0.01
    one, every, _ = draw_heights_of(heights, ["one", "two", "decoy"]).axes
    drawn = [line for line in one.get_lines() if line.get_label() in ("one", "two", "decoy")]
    assert [line.get_label() for line in drawn] == ["one", "two", "decoy"]
    np.testing.assert_allclose(drawn[2].get_ydata(), 100 * heights[0, 2])
    assert len({line.get_color() for line in drawn}) == 3
    assert [text.get_text() for text in one.get_legend().get_texts()] == ["goal: the height at the start"]
    np.testing.assert_allclose(every.get_lines()[0].get_ydata(), 100 * heights[:, 0].mean(axis=0))


def test_heights_around_the_goal_are_enlarged_however_few_observers():
    """Two observers' heights are enlarged to -1.5 to 1.5, with intervals twelve times as wide as their distance."""
    curve = np.sin(np.linspace(0, 3, 31)) / np.sin(np.linspace(0, 3, 31)).max()
    heights = np.stack([[-0.05 * curve, size * 0.01 * curve, 0.14 * curve] for size in (0.1, 1.9)])
    _, every, near = draw_heights_of(heights, ["one", "two", "decoy"]).axes
    (low, high), (least, most) = near.get_ylim(), every.get_ylim()
    assert least <= low < high <= most
    assert (low, high) == pytest.approx((-1.5, 1.5))
    assert "enlarged" in near.get_title()


def test_points_of_the_decoy_are_all_drawn_and_told_apart(rng):
    times, mean = np.linspace(0, 3, 31), estimate_mean(rng.normal(size=(6, 4, 31)) * 0.01)
    names = [f"point {k}" for k in range(7)]
    figure = draw_heights_of_points(
        times=times,
        shown=mean.mean,
        mean=mean,
        decoy={name: estimate_mean(rng.normal(size=(6, 31)) * 0.01) for name in names},
        labels=["one", "two", "three", "decoy"],
        shown_label="seed 0",
        num_repeats=6,
    )
    *_, points = figure.axes
    of_objects, of_points = ([text.get_text() for text in legend.get_texts()] for legend in figure.legends)
    assert (of_objects, of_points) == (["one", "two", "three", "decoy"], names)
    assert_told_apart(points, names)


def test_times_of_neighbouring_panels_are_apart(rng):
    times, mean = np.linspace(0, 3, 31), estimate_mean(rng.normal(size=(6, 3, 31)) * 0.01)
    decoy = {"centre": estimate_mean(rng.normal(size=(6, 31)) * 0.01)}
    figure = draw_heights_of_points(
        times=times,
        shown=mean.mean,
        mean=mean,
        decoy=decoy,
        labels=["one", "two", "decoy"],
        shown_label="",
        num_repeats=6,
    )
    prepare_figure(figure)
    FigureCanvasAgg(figure).draw()
    for left, right in itertools.pairwise(figure.axes):
        last, first = left.get_xticklabels()[-1], right.get_xticklabels()[0]
        assert first.get_window_extent().x0 - last.get_window_extent().x1 > 0.5 * last.get_window_extent().width


def test_any_number_of_paths_is_drawn_and_told_apart(rng):
    paths = {f"held by {k}": rng.normal(size=(5, 3)) for k in range(9)}
    for axes in draw_paths(rng.normal(size=(5, 3)), paths).axes:
        assert_told_apart(axes, list(paths))


def assert_told_apart(axes, labels):
    drawn = [line for line in axes.get_lines() if line.get_label() in labels]
    assert [line.get_label() for line in drawn] == labels
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn}) == len(labels)


@pytest.mark.usefixtures("fine")
def test_figures_are_saved_as_pictures_and_the_same_twice(tmp_path):
    save_figure(draw_figure3(), tmp_path, "a")
    save_figure(draw_figure3(), tmp_path, "b")
    assert imread(tmp_path / "a.png").shape[1] >= 1500
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def draw_objects_named(names):
    return draw_heights_of(0.01 * np.random.default_rng(0).normal(size=(6, len(names), 31)), names)


@pytest.mark.usefixtures("vectors")
def test_names_are_never_read_as_formulae(tmp_path):
    save_figure(draw_objects_named([r"$5 \foo$ rod", "rod", "decoy"]), tmp_path, "a")
    assert r"$5 \foo$ rod" in (tmp_path / "a.svg").read_text(encoding="utf-8")


def test_twelve_objects_have_room_for_their_names(tmp_path):
    names = [f"a rod of brass, number {k}" for k in range(12)]
    figure = draw_objects_named(names)
    save_figure(figure, tmp_path, "a")
    legend = figure.legends[0].get_window_extent()
    assert legend.x0 >= 0.0
    assert legend.x1 <= figure.bbox.x1


def test_names_are_in_the_legend_without_underscores(tmp_path):
    names = ["_one", "two", "_decoy"]
    (legend,) = draw_objects_named(names).legends
    assert [text.get_text() for text in legend.get_texts()] == [" one", "two", " decoy"]


def test_long_names_leave_room_for_the_curves(tmp_path):
    curve = estimate_mean(np.full((3, 7), 0.5))
    names = [f"{end}_end_of_an_extraordinarily_long_painted_handle, one density drawn" for end in ("upper", "lower")]
    figure = draw_choices({"stick": dict.fromkeys(names, curve)}, title="Choices")
    save_figure(figure, tmp_path, "a")
    legend, axes = figure.axes[0].get_legend().get_window_extent(), figure.axes[0].get_window_extent()
    assert axes.x0 <= legend.x0 < legend.x1 <= axes.x1
    assert axes.width > 0.8 * figure.bbox.width
