"""Check that nothing written on a figure lies beyond it."""

from matplotlib.text import Text

from affordance.reporting.figures import prepare_figure

# Labels as long as users may choose.
LONG_NAMES = [f"held by _{end}_end_of_an_extraordinarily_long_painted_handle" for end in ("upper", "lower")]


def assert_all_is_on_the_figure(figure, folder):
    prepare_figure(figure)
    figure.draw_without_rendering()
    for text in figure.findobj(Text):
        if text.get_text() and text.get_visible():
            box = text.get_window_extent()
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, text
            assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1, text
