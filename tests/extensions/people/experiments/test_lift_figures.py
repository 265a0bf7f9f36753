"""Figures of lifts: forces, or shares of the true weight where each observer lifts another object."""

import numpy as np

from affordance.extensions.people.experiments.lift_figures import LiftCurve, draw_lifts


def test_forces_for_different_weights_are_drawn_as_shares_of_them():
    weights = np.array([[2.0, 4.0, 8.0], [8.0, 2.0, 4.0]])
    curve = LiftCurve("kinds", weights * [0.5, 1.0, 1.0], None).divide(weights)
    (axes,) = draw_lifts([curve], weights=None, people=(), title="Family").axes
    curves = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(curves["mean of observers"], [0.5, 1.0, 1.0])
    np.testing.assert_array_equal(curves["true weight"], 1.0)
    assert axes.get_ylabel() == "force before release over weight"
