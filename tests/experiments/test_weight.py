"""Experiment ``weight``: few observers, short holds where the length does not matter."""

import dataclasses
import itertools
import json
import shutil
from functools import partial

import numpy as np
import pytest
from helpers.results_contract import check_results
from scipy.io import netcdf_file

from affordance.exceptions import BadValueError, ModelFileError
from affordance.experiments import weight
from affordance.experiments.shared.checks import check_tools_can_be_held
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_materials, load_tools
from affordance.runs.repeats import run_repeats
from affordance.settings import Settings

CONTRACT = {
    "density_true": (),
    "density_p25": (5,),
    "density_median": (5,),
    "density_p75": (5,),
    "drop_m": (4,),
    "drop_m_ci95": (4, 2),
    "deviation_m": (4,),
    "mass_true": (4,),
    "decoy_lift_m": (),
    "decoy_lift_m_ci95": (2,),
    "decoy_rises": (),
    "decoy_density_true": (),
}


@pytest.fixture(scope="module")
def short(weight):
    return dataclasses.replace(weight, duration=0.1)


@pytest.fixture(scope="module")
def folder(weight, tmp_path_factory):
    """The whole experiment with three observers, run once."""
    folder = tmp_path_factory.mktemp("weight")
    weight.run(weight, folder, repeats=3, jobs=1)
    return folder


def test_results_keep_the_contract(folder):
    numbers = check_results(folder, CONTRACT, ("figure3", "figure4"))
    assert numbers["repeats"] == 3
    assert numbers["versions"]["drake"]
    assert numbers["config"]["settings"]["noise"] == {"weber_fraction": 0.07, "threshold": 0.097}


def test_what_the_paper_says_is_seen_with_a_few_observers(folder):
    numbers = json.loads((folder / "metrics.json").read_text())
    assert numbers["density_median"][0] < numbers["density_true"]
    spread = np.subtract(numbers["density_p75"], numbers["density_p25"])
    assert (np.diff(spread) < 0).all()
    assert numbers["drop_m"][3] < 0.25 * numbers["drop_m"][0]
    assert numbers["decoy_rises"] == 1.0
    assert numbers["decoy_lift_m"] > 5 * numbers["deviation_m"][3]


def test_trajectories_are_those_of_the_metrics(folder):
    numbers = json.loads((folder / "metrics.json").read_text())
    with netcdf_file(folder / "trajectories.nc", mmap=False) as file:
        height = file.variables["height_centre"][:]
        assert height.shape == (3, 5, 301)
        assert file.variables["q"].shape == (5, 301, 7)
        assert file.trial_names.decode().split(", ")[-1] == "decoy"
    np.testing.assert_allclose(np.maximum(0, -height.min(axis=2)).mean(axis=0)[:4], numbers["drop_m"])


def test_section_says_met_or_not_of_every_claim(folder):
    section = json.loads((folder / "section.json").read_text())
    assert len(section["claims"]) == 6
    for claim in section["claims"]:
        assert isinstance(claim["met"], bool)
        assert any(character.isdigit() for character in claim["found"])


def test_claims_are_not_met_by_numbers_that_contradict_them(weight, folder):
    """The verdicts can fail: an arm that learns nothing, and a decoy that sinks."""
    numbers = json.loads((folder / "metrics.json").read_text())
    numbers = {key: np.array(value) if isinstance(value, list) else value for key, value in numbers.items()}
    stubborn = {
        "density_median": np.full(5, 3000.0),
        "density_p25": np.full(5, 1500.0),
        "density_p75": np.full(5, 5000.0),
        "density_mode": np.full(5, 9000.0),
        "drop_m": np.array([0.1, 0.2, 0.3, 0.4]),
        "drop_growth_m_ci95": np.full((3, 2), 0.1),
        "deviation_m": np.array([0.1, 0.2, 0.3, 0.4]),
        "decoy_lift_m": 0.0,
        "decoy_rises": 0.0,
    }
    section = weight.describe(weight, {**numbers, **stubborn}, 3)
    assert not any(claim.met for claim in section.claims)


def test_summary_says_what_the_decoy_looks_like_and_is_made_of(weight, folder):
    numbers = json.loads((folder / "metrics.json").read_text())
    numbers = {key: np.array(value) if isinstance(value, list) else value for key, value in numbers.items()}
    summary = weight.describe(weight, numbers, 3).summary
    assert "Verdicts want about 20 observers" in summary
    assert "looks like the last one and is made of beech" in summary
    shuffled = dataclasses.replace(weight, tools=(*weight.tools[3::-1], weight.tools[-1]))
    assert "looks like brass and is made of beech" in weight.describe(shuffled, numbers, 3).summary


def test_numbers_are_identical_for_any_number_of_jobs(short, tmp_path):
    run = partial(weight.run_repeat, short)
    alone = run_repeats(tmp_path / "1", run, repeats=4, jobs=1, description="alone")
    parallel = run_repeats(tmp_path / "2", run, repeats=4, jobs=2, description="parallel")
    assert alone.keys() == parallel.keys()
    for name in alone:
        np.testing.assert_array_equal(alone[name], parallel[name])
        assert name == "times" or (alone[name][0] != alone[name][1]).any() or not alone[name].any()


def test_seed_decides_the_numbers(short):
    first, again = weight.run_repeat(short, 0), weight.run_repeat(short, 0)
    other = weight.run_repeat(dataclasses.replace(short, seed=1), 0)
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
    assert (first["density_quartiles"][1:] != other["density_quartiles"][1:]).all()


def test_experience_is_carried_from_trial_to_trial(weight):
    records, memories = weight.run_observer(dataclasses.replace(weight, duration=0.5), 0)
    assert len(records) == 5
    sds = [np.sqrt(memory.belief.covariance[0, 0]) for memory in memories]
    assert all(later < earlier for earlier, later in itertools.pairwise(sds))


def write_models(tmp_path, old, new):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "tools" / "weight.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return tmp_path / "models"


def test_objects_of_several_looks_are_refused(tmp_path):
    models = write_models(tmp_path, "material: beech, looks_like: brass", "material: beech")
    with pytest.raises(BadValueError, match=r"weight.yaml: tools: look like beech, brass, must all look like one"):
        weight.load_config(models)


def test_honest_objects_of_another_material_are_refused(tmp_path):
    models = write_models(
        tmp_path,
        "[0.050, 0.015, 0.015], position: [0.050, 0, 0], material: brass",
        "[0.050, 0.015, 0.015], position: [0.050, 0, 0], material: steel, looks_like: brass",
    )
    with pytest.raises(BadValueError, match=r"before the decoy are made of brass, steel, must be of the one"):
        weight.load_config(models)


@pytest.mark.parametrize("density", [8500.0, 11340.0])
def test_decoy_that_is_not_lighter_than_it_looks_is_refused(tmp_path, density):
    models = write_models(tmp_path, "material: beech, looks_like: brass", "material: dense, looks_like: brass")
    materials = models / "materials.yaml"
    entry = f'dense: {{colour: "#112233", density: {density}, density_sd: 87, source: test}}\n'
    materials.write_text(materials.read_text() + entry)
    message = rf"weight.yaml: tools: decoy: has a density of {density:g} kg/m\^3, must be less than the 8500 of brass"
    with pytest.raises(BadValueError, match=message):
        weight.load_config(models)


def test_object_that_is_too_heavy_for_a_joint_is_refused_by_name(tmp_path):
    models = write_models(tmp_path, "[0.125, 0.015, 0.015]", "[0.125, 0.06, 0.06]")
    # 16.0 kg 0.315 m from the wrist, and the hand's 0.438 kg at 0.095 m: 49.9 N m.
    message = r"tools: rod_25cm: weighs 16 kg and loads wrist_flexion with 49.9 N m .* must be at most 7.1 N m"
    with pytest.raises(BadValueError, match=message):
        weight.load_config(models)


def test_mesh_that_is_missing_is_refused(tmp_path):
    models = write_models(tmp_path, "", "")
    arm = models / "arm.sdf"
    text = arm.read_text()
    start = text.index("<ellipsoid>")
    end = text.index("</ellipsoid>") + len("</ellipsoid>")
    arm.write_text(text[:start] + "<mesh><uri>package://models/none.obj</uri></mesh>" + text[end:])
    with pytest.raises(ModelFileError, match=r"arm.dmd.yaml: .*none.obj") as error:
        weight.load_config(models)
    assert "\n" not in str(error.value)


def test_more_objects_than_colours_are_drawn(weight, tmp_path):
    *honest, decoy = weight.tools
    many = [dataclasses.replace(honest[k % 4], name=f"rod {k}") for k in range(8)]
    config = dataclasses.replace(weight, tools=(*many, decoy), duration=0.05)
    weight.run(config, tmp_path, repeats=2, jobs=1)
    assert (tmp_path / "metrics.json").exists()


def test_decoy_alone_is_refused(tmp_path):
    models = write_models(tmp_path, "", "")
    path = models / "tools" / "weight.yaml"
    head, *_, decoy = path.read_text().split("  - name:")
    path.write_text(f"{head}  - name:{decoy}")
    with pytest.raises(BadValueError, match=r"weight.yaml: tools: has 1 entries, must have at least 3"):
        weight.load_config(models)


def test_arm_that_cannot_hold_itself_is_not_put_down_to_the_tool(tmp_path):
    for name in ("arm.sdf", "arm.dmd.yaml", "package.xml"):
        (tmp_path / name).write_text((MODELS / name).read_text().replace("<effort>68.6<", "<effort>1<"))
    tools = load_tools(MODELS / "tools" / "weight.yaml", load_materials(MODELS / "materials.yaml"))
    with pytest.raises(ModelFileError, match=r"loads shoulder_elevation with .* empty hand, must be at most 1 N m"):
        check_tools_can_be_held(tmp_path / "weight.yaml", tools, Settings(arm=tmp_path / "arm.dmd.yaml"))
