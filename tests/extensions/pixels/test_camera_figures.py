"""Pictures of vision have titles that can be read, and show the numbers that they are given."""

import numpy as np
import pytest
from scipy.stats import norm

from affordance.extensions.pixels.camera_figures import CameraView, draw_calibration, draw_camera_views
from affordance.extensions.pixels.rgbd import Picture
from affordance.reporting.figures import save_figure


def test_titles_of_rows_stand_over_headings_of_columns(tmp_path):
    picture = Picture(np.zeros((480, 640, 3), dtype=np.uint8), np.ones((480, 640)))
    why = "the object nearer than the stand covers 40 pixels, must cover at least 110, and more " * 3
    figure = draw_camera_views([CameraView("crumb", picture, None, why), CameraView("rod", picture, None)])
    save_figure(figure, tmp_path, "failures")
    first, second = figure.subfigs
    (title,) = first.texts
    headings = [axes.title.get_window_extent() for axes in first.axes]
    assert [axes.title.get_text() for axes in first.axes] == ["colour", "depth", "parts", "fitted ellipsoids"]
    assert title.get_window_extent().y0 >= max(heading.y1 for heading in headings)
    assert title.get_window_extent().x1 <= figure.bbox.x1
    assert second.texts[0].get_window_extent().y1 <= min(axes.bbox.y0 for axes in first.axes)


def test_calibration_is_drawn_as_the_share_of_intervals_that_hold_the_truth():
    """Errors lie at the quantiles of a normal distribution whose SD is half, once or twice the claimed one."""
    claimed = norm.ppf((np.arange(2000) + 0.5) / 2000)
    for factor in (0.5, 1.0, 2.0):
        figure = draw_calibration(errors={"size": np.ones(3)}, targets={"size": 0.1}, claimed=factor * claimed)
        _, right = figure.axes
        (line,) = (line for line in right.lines if str(line.get_label()).startswith("predicted mass"))
        levels, covered = line.get_data()
        np.testing.assert_allclose(covered, 2.0 * norm.cdf(norm.ppf(0.5 + 0.5 * levels) / factor) - 1.0, atol=1e-3)


def test_errors_are_drawn_in_per_cent_with_their_targets():
    """Half of the cases have at most the median of the errors."""
    errors = np.array([0.04, 0.01, 0.03, 0.02, 0.05])
    figure = draw_calibration(errors={"size": errors}, targets={"size": 0.1}, claimed=np.ones(2))
    left, _ = figure.axes
    curve, target, *_ = left.lines
    assert np.interp(3.0, *curve.get_data()) == pytest.approx(0.5)
    assert [*curve.get_xdata()] == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0])
    assert np.ravel(target.get_data()) == pytest.approx([10.0, 0.5])
