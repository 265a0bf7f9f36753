"""Pictures of vision have titles that can be read."""

import numpy as np

from affordance.reporting.camera_figures import CameraView, draw_camera_views
from affordance.reporting.figures import save_figure
from affordance.vision.pixels.rgbd import Picture


def test_titles_of_rows_stand_over_headings_of_columns(tmp_path):
    picture = Picture(np.zeros((480, 640, 3), dtype=np.uint8), np.ones((480, 640)))
    why = "what is nearer than the stand covers 40 pixels, must cover at least 110, and more " * 3
    figure = draw_camera_views([CameraView("crumb", picture, None, why), CameraView("rod", picture, None)])
    save_figure(figure, tmp_path, "failures")
    first, second = figure.subfigs
    (title,) = first.texts
    headings = [axes.title.get_window_extent() for axes in first.axes]
    assert [axes.title.get_text() for axes in first.axes] == ["colour", "depth", "parts", "fitted ellipsoids"]
    assert title.get_window_extent().y0 >= max(heading.y1 for heading in headings)
    assert title.get_window_extent().x1 <= figure.bbox.x1
    assert second.texts[0].get_window_extent().y1 <= min(axes.bbox.y0 for axes in first.axes)
