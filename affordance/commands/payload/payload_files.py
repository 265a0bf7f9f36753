"""Writes the files of an identified payload: figures, posterior samples and gains."""

from pathlib import Path

from affordance.extensions.payload.evidence.gains import write_gains
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief


def write_belief(folder: Path, belief: PayloadBelief, is_used: bool) -> None:
    """Writes figures, samples and, if the result is used, the gains calibrated with a weighed load."""
    # Imported here: these imports take most of a second, and runs without --out do not need them.
    from affordance.extensions.payload.netcdf import LabelledArray, Trajectories, write_trajectories
    from affordance.extensions.payload.payload_figures import draw_fit, draw_posteriors, draw_whiteness
    from affordance.reporting.figures import save_figure

    save_figure(draw_fit(belief.fit), folder, "fit")
    save_figure(draw_posteriors(belief), folder, "posteriors")
    if not belief.fit.evidence.is_at_rest:  # separate postures have no time series to autocorrelate
        save_figure(draw_whiteness(belief.fit), folder, "whiteness")
    if belief.calibration is not None and is_used:
        write_gains(folder / "gains.yaml", belief.calibration)
    meaning = "mass, first moment, moments and products of inertia about the tip"
    samples = Trajectories(
        {
            "parameters": LabelledArray(("sample", "parameter"), belief.bodies.pi, "kg, kg m, kg m^2", meaning),
            "weight": LabelledArray(
                ("sample",), belief.bodies.weights, "1", "weight of each sample; all weights sum to one"
            ),
        },
        {"parameter": ["m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"]},
    )
    write_trajectories(folder / "samples.nc", samples)
