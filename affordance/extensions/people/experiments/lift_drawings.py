"""Figures of lift forces."""

import itertools
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from affordance.extensions.people.reporting.lift_figures import LiftCurve, PeopleMark, draw_lifts
from affordance.extensions.people.rivals import label_learner


def draw_forces(
    lifts: pd.DataFrame,
    objects: Sequence[str],
    *,
    title: str,
    predicted_by: Sequence[str] = (),
    people: Sequence[PeopleMark] = (),
) -> Figure:
    """Draws the lift forces for some objects, one panel per learner.

    Where the objects' weights differ, forces are divided by the weight. The dashed curve shows what other objects
    predict: a line through force and size, fitted to their lifts between this lift and the next one that is drawn.

    Args:
        lifts: Table of lifts of all observers, with forces and weights, [N], and sizes, [m^3].
        objects: Names of the objects whose lifts are drawn.
        title: Title of the figure.
        predicted_by: Names of the objects that predict the force; nothing is predicted if empty.
        people: Published results of people to mark.
    """
    chosen = lifts[lifts["object"].isin(objects)]
    observers = lifts["observer"].nunique()
    curves = []
    for learner, own in lifts.groupby("learner", sort=False):
        forces = own.loc[own["object"].isin(objects), "force"].to_numpy().reshape(observers, -1)
        predicted = None
        if predicted_by:
            rows = [_predict(each, objects, predicted_by) for _, each in own.groupby("observer")]
            predicted = np.array(rows)
        curves.append(LiftCurve(label_learner(str(learner)), forces, predicted))
    weights = chosen["weight"].to_numpy()[: curves[0].forces.size].reshape(observers, -1)
    if np.ptp(weights) and not people:
        return draw_lifts([curve.divide(weights) for curve in curves], weights=None, people=(), title=title)
    return draw_lifts(curves, weights=weights[0], people=people, title=title)


def _predict(lifts: pd.DataFrame, objects: Sequence[str], others: Sequence[str]) -> list[float]:
    """Predicts the force in each lift of ``objects`` from the lifts of ``others`` that follow it."""
    places = [*np.flatnonzero(lifts["object"].isin(objects)), len(lifts)]
    predicted = []
    for start, end in itertools.pairwise(places):
        between = lifts.iloc[start:end]
        between = between[between["object"].isin(others)]
        predicted.append(predict_by_size(between, float(lifts["size"].iloc[start])) if len(between) > 1 else np.nan)
    return predicted


def predict_by_size(lifts: pd.DataFrame, size: float) -> float:
    """Predicts the force for an object of a given size, [m^3], with a line fitted to other lifts, [N]."""
    slope, intercept = np.polyfit(lifts["size"].to_numpy(), lifts["force"].to_numpy(), 1)
    return float(intercept + slope * size)
