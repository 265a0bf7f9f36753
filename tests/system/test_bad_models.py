"""Files in a folder of models that make no experiment are refused before anything is simulated or written."""

from pathlib import Path

import pytest
import yaml
from helpers.refusals import refuse, refuse_command

from affordance.commands.catalogue import find_experiment
from affordance.exceptions import InfeasibleError
from affordance.experiments import hammer, reach
from affordance.experiments.shared import blows
from affordance.experiments.shared.observers import Setup
from affordance.extensions.pixels.experiments import vision

WEIGHT, COM, NOVEL, MATERIALS = "tools/weight.yaml", "tools/com.yaml", "tools/novel.yaml", "materials.yaml"
PATH, NAIL = "paths/reach.yaml", "nail.yaml"
JOINTS = "shoulder_azimuth, shoulder_elevation, shoulder_rotation, elbow_flexion, forearm_rotation, wrist_flexion, "
JOINTS += "wrist_deviation"
ALIKE = "com.yaml: tools: show beech and steel, whose colours must differ by more than 0.02"


def change(file: Path, old: str, new: str) -> None:
    """Replaces the first place of a text in a file."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "said"),
    [
        (
            "weight",
            WEIGHT,
            "material: brass",
            "material: gold",
            "tools[0].components[0].material: is 'gold', must be",
        ),
        ("weight", WEIGHT, "[0.050, 0.015, 0.015]", "[50, 15, 15]", "[0].semi_axes[0]: is 50, must be from 0.0001"),
        (
            "weight",
            WEIGHT,
            "[0.050, 0.015",
            "[0.050, -0.015",
            "[0].semi_axes[1]: is -0.015, must be from 0.0001 to 1",
        ),
        ("weight", WEIGHT, "[0.050, 0, 0]", "[0.050, .nan, 0]", "components[0].position[1]: is nan, must be"),
        ("weight", WEIGHT, "    components", "\tcomponents", "weight.yaml: line 7, column 1: is not YAML"),
        ("weight", WEIGHT, "rod_15cm", "rod_10cm", "tools[1].name: is 'rod_10cm', the name of an earlier tool"),
        (
            "weight",
            WEIGHT,
            ", looks_like: brass",
            "",
            "tools: look like beech, brass, must all look like one material",
        ),
        (
            "weight",
            WEIGHT,
            "material: brass",
            "material: steel, looks_like: brass",
            "tools: rod_10cm.components[0].looks_like: is 'brass', must be what it is made of, 'steel'",
        ),
        ("weight", MATERIALS, '"#d4a017"', "gold", "materials.yaml: brass.colour: is 'gold', must be red, green and"),
        (
            "weight",
            MATERIALS,
            "density: 8500",
            "density: 8.5 g/cm3",
            "brass.density: is '8.5 g/cm3', must be a number",
        ),
        ("weight", MATERIALS, "  density_sd: 72\n", "", "materials.yaml: beech.density_sd: is missing"),
        (
            "weight",
            MATERIALS,
            "density: 720",
            "density: 8500",
            "weight.yaml: tools: decoy: has a density of 8500 kg/m^3, must be less than the 8500 of brass",
        ),
        (
            "weight",
            MATERIALS,
            "density: 720",
            "density: 11340",
            "weight.yaml: tools: decoy: has a density of 11340 kg/m^3, must be less than the 8500 of brass",
        ),
        (
            "com",
            COM,
            "[0.25, 0, 0], material: steel}",
            "[0.25, 0, 0], material: brass}",
            "com.yaml: tools: steel_near: weighs 0.77827722 kg, must weigh the same as steel_far",
        ),
        (
            "com",
            COM,
            "material: steel, looks_like: beech",
            "material: steel",
            "tools: decoy: looks unlike steel_far, must look the same",
        ),
        (
            "com",
            COM,
            "[0.05, 0, 0], material: beech}",
            "[0.05, 0, 0], material: beech, looks_like: steel}",
            "steel_far.components[0].looks_like: is 'steel', must be what it is made of, 'beech'",
        ),
        ("com", MATERIALS, "#c98f5a", "#828e9d", ALIKE),
        ("com", MATERIALS, "#c98f5a", "#828f9d", ALIKE),
        ("com", MATERIALS, "#c98f5a", "#828f9e", ALIKE),
        ("com", MATERIALS, "#c98f5a", "#788594", ALIKE),
        ("com", MATERIALS, "#c98f5a", "#7d8a99", ALIKE),
        ("reach", NOVEL, "      wood: {position: [0, 0, 0]}\n", "", "tools: stick.grips: has 1 entries, must have 2"),
        (
            "reach",
            NOVEL,
            "material: steel}",
            "material: brass}",
            "tools: stick: looks like brass, must look like what",
        ),
        (
            "reach",
            NOVEL,
            "material: steel}",
            "material: beech, looks_like: steel}",
            "stick.components[1].looks_like: is 'steel', must be what it is made of, 'beech'",
        ),
        ("reach", PATH, "[-0.25, 0.40, 0.10]", "[-0.10, 0.20, 0.20]", "points[1]: is 0 m from the previous point"),
        ("reach", PATH, "duration: 2.0", "duration: -2", "reach.yaml: duration: is -2, must be from 0.05 to 60"),
        (
            "reach",
            PATH,
            "elbow_flexion: 1.1376",
            "elbow_flexion: 3.0",
            "start.elbow_flexion: sets elbow_flexion to 3 rad, must be from -0.034907 to 2.548181 rad",
        ),
        (
            "reach",
            PATH,
            "elbow_flexion",
            "elbow_flexoin",
            f"start.elbow_flexoin: is 'elbow_flexoin', must be one of {JOINTS}; did you mean 'elbow_flexion'?",
        ),
        ("reach", PATH, "1.1376", ".nan", "reach.yaml: start.elbow_flexion: is nan, must be from"),
        (
            "hammer",
            NAIL,
            "demanded: 0.01722",
            "demanded: 0.06",
            "nail.yaml: depth_demanded: is 0.06, must be from 0.005",
        ),
        ("hammer", NAIL, "demanded: 0.01722", "demanded: 0.004", "depth_demanded: is 0.004, must be from 0.005"),
        ("hammer", NAIL, "[0, 0, -1]", "[0, 0, 0]", "nail.yaml: blow.direction: has a length of 0, must be at least"),
        (
            "hammer",
            NAIL,
            "direction: [0, 0, -1]",
            "direction: [0, 0, 1]",
            "blow.offset: puts the head -0.1 m ahead of the tool's point along the blow, must be at least 0.01 m",
        ),
        (
            "hammer",
            NAIL,
            "elbow_flexion: 1.1376",
            "elbow_flex: 1.1376",
            f"blow.start.elbow_flex: is 'elbow_flex', must be one of {JOINTS}; did you mean 'elbow_flexion'?",
        ),
        (
            "hammer",
            NAIL,
            "wrist_flexion: -0.0374",
            "wrist_flexion: 3.0",
            "nail.yaml: blow.start.wrist_flexion: sets wrist_flexion to 3 rad, must be from -1.22173 to",
        ),
    ],
)
def test_mistake_in_a_file_is_refused(models: Path, name: str, file: str, old: str, new: str, said: str) -> None:
    change(models / file, old, new)
    assert said in refuse(find_experiment(name).read, Setup(models=models))


@pytest.mark.parametrize(
    ("name", "file", "kept", "said"),
    [
        (
            "weight",
            WEIGHT,
            slice(2),
            "weight.yaml: tools: has 2 entries, must have at least 3: two objects and the decoy",
        ),
        ("weight", WEIGHT, slice(4, 5), "weight.yaml: tools: has 1 entries, must have at least 3"),
        ("com", COM, slice(2), "com.yaml: tools: has 2 entries, must have 3: two objects and the decoy"),
        ("vision", "tools/uncommon.yaml", slice(1), "uncommon.yaml: tools: has 1 entries, must have 2"),
    ],
)
def test_too_few_objects_are_refused(models: Path, name: str, file: str, kept: slice, said: str) -> None:
    tools = yaml.safe_load((models / file).read_text(encoding="utf-8"))["tools"]
    (models / file).write_text(yaml.safe_dump({"tools": tools[kept]}), encoding="utf-8")
    assert said in refuse(find_experiment(name).read, Setup(models=models))


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "said"),
    [
        (
            "weight",
            WEIGHT,
            "[0.125, 0.015, 0.015]",
            "[0.125, 0.06, 0.06]",
            "weighs 16 kg and loads wrist_flexion with 49.9 N m in the home posture, must be at most 7.1 N m",
        ),
        (
            "reach",
            NOVEL,
            "[0.02, 0.05, 0.02]",
            "[0.02, 0.2, 0.2]",
            "weighs 26.4 kg and loads wrist_deviation with 106 N m in the start posture, must be at most",
        ),
    ],
)
def test_object_too_heavy_for_the_arm_is_refused(
    models: Path, name: str, file: str, old: str, new: str, said: str
) -> None:
    change(models / file, old, new)
    assert said in refuse(find_experiment(name).read, Setup(models=models), error=InfeasibleError)


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        (PATH, "[-0.10, 0.20, 0.20]", "[0.6, 0, 0]", "cannot be followed: the stick by wood leaves the path by 0.6"),
        (PATH, "[-0.30, 0.40, -0.10]", "[0.3, 0.8, 0.3]", "the stick by wood leaves the path by 0.2"),
        (PATH, "[-0.30, 0.40, -0.10]", "[1.9, 0.40, -0.10]", "reach.yaml: points: cannot be followed: the stick"),
        (PATH, "duration: 2.0", "duration: 0.05", "reach.yaml: points: cannot be followed: "),
        (PATH, "tolerance: 0.02", "tolerance: 0.001", "the stick by wood leaves the path by 0.002"),
        (
            NOVEL,
            "[0.225, 0, 0], material: steel}",
            "[0.225, 0, 0], material: beech}",
            "J in both grips, must have a cheaper one",
        ),
    ],
)
def test_reach_that_cannot_be_planned_is_refused(models: Path, file: str, old: str, new: str, said: str) -> None:
    change(models / file, old, new)
    setup = Setup(models=models)
    _, tools, task = reach.read(setup)
    assert said in refuse(reach.plan, setup, tools[:1], task)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[-0.1, 0, -0.1]", "[0.5, 0, -0.1]", "nail.yaml: blow: cannot be carried out: stick by wood: no swing"),
        (
            "depth_demanded: 0.01722",
            "depth_demanded: 0.05",
            "nail.yaml: depth_demanded: is 0.05 m and asks for 1240 N, for which with the stick by wood"
            " wrist_deviation must bear 2.4 times its torque limit; must be at most 0.0283 m",
        ),
    ],
)
def test_blow_that_cannot_be_planned_is_refused(models: Path, old: str, new: str, said: str) -> None:
    change(models / NAIL, old, new)
    setup = Setup(models=models)
    _, tools, task = hammer.read(setup)
    assert said in refuse(blows.plan_blows, setup, tools[:1], task, models / NAIL)


def test_mashing_that_cannot_be_planned_is_refused(models: Path) -> None:
    change(models / "paths/mash.yaml", "[0, 0, -0.12]", "[1.5, 0, 0]")
    setup = Setup(models=models)
    tools, task = vision.read(setup)
    assert "mash.yaml: points: cannot be followed" in refuse(vision.check_mashing, setup, tools, task)


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "said"),
    [
        (
            "weight",
            "faults.yaml",
            "delay_samples: 1",
            "delay_samples: 0.5",
            "delay.delay_samples: is 0.5, must be a whole",
        ),
        ("weight", "faults.yaml", "spike_height", "spike_hight", "spikes.spike_hight: is not a key known here"),
        ("weight", MATERIALS, "density: 8500", "density: 0", "materials.yaml: brass.density: is 0, must be from"),
        ("com", COM, "material: steel}", "", "com.yaml: line 11, column 3: is not YAML"),
        ("reach", PATH, "duration: 2.0", "duration: -2", "reach.yaml: duration: is -2, must be from 0.05 to 60"),
        ("hammer", NAIL, "demanded: 0.01722", "demanded: 0.06", "nail.yaml: depth_demanded: is 0.06, must be from"),
        (
            "vision",
            "paths/mash.yaml",
            "duration:",
            "duraton:",
            "mash.yaml: duration: is missing; is 'duraton' misspelt?",
        ),
    ],
)
def test_run_ends_before_anything_is_written(
    models: Path, monkeypatch: pytest.MonkeyPatch, name: str, file: str, old: str, new: str, said: str
) -> None:
    change(models / file, old, new)
    monkeypatch.chdir(models.parent)
    assert said in refuse_command("run", name, "--robot", "models", "--fault", "bias", "--jobs", 1, "--out", "out")
