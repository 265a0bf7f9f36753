"""Simulation I: few observers, short holds where the length does not matter."""

import dataclasses
import itertools
import re
from functools import partial

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray
from helpers.changed_files import change_file
from helpers.results_files import DOCS, read_section, render
from helpers.short_holds import shorten, with_tools
from helpers.stacked import stack

from affordance.exceptions import ModelFileError
from affordance.experiments.protocol_parts import check_tools_can_be_held
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.objects.load import load_tools
from affordance.runs.repeats import run_repeats
from affordance.settings import Settings


@pytest.fixture(scope="module")
def name():
    return "weight"


@pytest.fixture(scope="module")
def short(weight):
    return shorten(weight, 0.1)


def test_noise_is_said_and_figures_are_shown_in_order(folder, numbers):
    weber = {"weber_fraction": 0.07, "threshold": 0.097, "independent_samples": False}
    assert numbers["config"]["settings"]["noise"] == weber
    section = read_section(folder)
    assert section.claims["first_object"].criteria[0]["value"].startswith(f"{100 * numbers['drop_m'][0]:.1f}")
    assert [figure["file"] for figure in section.figures] == ["figure3.png", "figure4.png", "diagram.svg"]


def test_what_the_paper_says_is_seen_with_a_few_observers(numbers):
    assert numbers["density_median"][0] < numbers["density_true"]
    spread = np.subtract(numbers["density_p75"], numbers["density_p25"])
    assert (np.diff(spread) < 0).all()
    assert numbers["drop_m"][3] < 0.25 * numbers["drop_m"][0]
    assert numbers["decoy_rises"] == 1.0
    assert numbers["decoy_lift_m"] > 5 * numbers["deviation_m"][3]


def test_trajectories_are_those_of_the_metrics(weight, folder, numbers):
    with xarray.open_dataset(folder / "trajectories.nc", engine="scipy") as dataset:
        found = dataset.load()
    assert found["height_centre"].shape == (2, 5, 301)
    assert found["trial"].values.tolist() == [tool.name for tool in weight.tools]
    drops = np.maximum(0, -found["height_centre"].min("time")).mean("repeat")
    np.testing.assert_allclose(drops[:4], numbers["drop_m"])
    assert found["percentile"].values.tolist() == [25.0, 50.0, 75.0]
    np.testing.assert_allclose(found["density"].sel(percentile=50.0).median("repeat")[:5], numbers["density_median"])


def test_documented_lines_open_and_plot_a_trajectory(folder, tmp_path, monkeypatch):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "weight").symlink_to(folder)
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    opened = {}
    with plt.rc_context({"backend": "agg"}):
        exec(block, opened)
        (axes,) = plt.gcf().axes
    assert [text.get_text() for text in axes.get_legend().texts] == opened["trajectories"].trial.values.tolist()
    assert axes.get_xlabel() == "time since the trial began [s]"
    plt.close("all")
    opened["trajectories"].close()


def test_motions_of_each_trial_are_those_of_its_own_heights(weight, folder, chain):
    """Heights by angles of each trial agree to 1e-12 m with those logged for the centre of its object."""
    with xarray.open_dataset(folder / "trajectories.nc", engine="scipy") as dataset:
        found = dataset.load()
    for trial, tool in enumerate(weight.tools):
        q = found["q"].values[trial]
        assert q.shape == (301, 7)
        heights = chain.compute_positions(q, tool.p_TTcentre)[:, 2]
        np.testing.assert_allclose(heights - heights[0], found["height_centre"].values[0, trial], atol=1e-12)
        slopes = (q[2:] - q[:-2]) / 0.02
        velocities = found["v"].values[trial]
        # The first moments, in which an unheld arm begins to fall, are left out.
        np.testing.assert_allclose(slopes[5:], velocities[6:-1], atol=0.02 * np.abs(velocities).max() + 1e-9)


def test_summary_says_what_the_decoy_looks_like_and_is_made_of(weight, numbers):
    section = render(weight, None, numbers)
    assert "looks like the last one and is made of beech" in section.summary
    shuffled = with_tools(weight, (*weight.tools[3::-1], weight.tools[-1]))
    assert "looks like brass and is made of beech" in render(shuffled, None, numbers).summary


@pytest.mark.parametrize(
    ("repeats", "few", "begins"), [(1, True, "1 observer was"), (20, False, "20 observers were")]
)
def test_few_observers_are_named_as_few(weight, numbers, repeats, few, begins):
    section = render(weight, None, numbers, repeats=repeats)
    assert section.summary.startswith(f"{begins} simulated.")
    assert section.caution == ("Only 1 observer: claims need about 20 or more." if few else "")


def test_numbers_are_identical_for_any_number_of_jobs(short, tmp_path):
    run = partial(short.run_observer, None, None)
    alone = run_repeats(tmp_path / "1", run, repeats=2, jobs=1, description="alone")
    parallel = run_repeats(tmp_path / "2", run, repeats=2, jobs=2, description="parallel")
    assert alone.keys() == parallel.keys()
    for name in alone:
        np.testing.assert_array_equal(alone[name], parallel[name])
        assert (
            name in ("times", "weight", "presented", "densities", "row tool", "row block", "row cycle", "row mass")
            or (alone[name][0] != alone[name][1]).any()
            or not alone[name].any()
        )


def test_seed_decides_the_numbers(short):
    first, again = (short.run_observer(None, None, 0) for _ in range(2))
    other = dataclasses.replace(short, seed=1).run_observer(None, None, 0)
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
    assert (first["density_quantiles"][1:] != other["density_quantiles"][1:]).all()


def test_experience_is_carried_from_trial_to_trial(weight):
    presented = shorten(weight, 0.5).present(None, 0)
    assert len(presented) == 5
    sds = [np.sqrt(memory.belief.covariance[0, 0]) for each in presented for memory in each.memories[1:]]
    assert all(later < earlier for earlier, later in itertools.pairwise(sds))


def test_mesh_that_is_missing_is_refused(models):
    text = (models / "arm.sdf").read_text(encoding="utf-8")
    ellipsoid = text[text.index("<ellipsoid>") : text.index("</ellipsoid>")] + "</ellipsoid>"
    change_file(models / "arm.sdf", ellipsoid, "<mesh><uri>package://models/none.obj</uri></mesh>")
    with pytest.raises(ModelFileError, match=r"arm.dmd.yaml: .*none.obj") as error:
        load_hold_experiment("weight", models, settings=Settings(arm=models / "arm.dmd.yaml"))
    assert "\n" not in str(error.value)


def test_more_objects_than_colours_are_drawn(weight):
    *honest, decoy = weight.tools
    many = [dataclasses.replace(honest[k % 4], name=f"rod {k}") for k in range(8)]
    groups = {"all": list(range(9)), "honest": list(range(8)), "decoy": [8]}
    experiment = shorten(with_tools(weight, (*many, decoy), groups=groups), 0.1)
    arrays = stack([experiment.run_observer(None, None, repeat) for repeat in range(2)])
    shown = experiment.show(None, None, arrays, experiment.compute_metrics(None, None, arrays))
    assert shown.figures.keys() == {"figure3", "figure4"}
    for draw in shown.figures.values():
        assert draw().axes


def test_arm_that_cannot_hold_itself_is_not_put_down_to_the_tool(models):
    change_file(models / "arm.sdf", "<effort>68.6<", "<effort>1<")
    path, settings = models / "tools" / "weight.yaml", Settings(arm=models / "arm.dmd.yaml")
    with pytest.raises(ModelFileError, match=r"loads shoulder_elevation with .* empty hand, must be at most 1 N m"):
        check_tools_can_be_held(path, load_tools(path), settings)
