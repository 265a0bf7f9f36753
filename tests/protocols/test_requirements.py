"""Objects that do not make an experiment are refused when its protocol is read, by file and key."""

import shutil

import pytest

from affordance.exceptions import BadValueError
from affordance.experiments.suite import load_experiment
from affordance.files.model_folder import MODELS

DECOY = "material: beech, looks_like: brass"
DENSE = 'dense: {{colour: "#112233", density: {}, density_sd: 87, source: test}}\n'
LIGHTER = r"tools: decoy: has a density of {:g} kg/m\^3, must be less than the 8500 of brass"
FIRST = "[0.050, 0.015, 0.015], position: [0.050, 0, 0], material: "
HEAD, FOOT = "  - name:", "  - name: decoy"


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("weight", [(DECOY, "material: beech")], "tools: look like beech, brass, must all look like one"),
        (
            "weight",
            [(f"{FIRST}brass", f"{FIRST}steel, looks_like: brass")],
            "before the decoy are made of brass, steel, must be of the one",
        ),
        *(
            ("weight", [(DECOY, "material: dense, looks_like: brass"), DENSE.format(each)], LIGHTER.format(each))
            for each in (8500.0, 11340.0)
        ),
        # 16.0 kg 0.315 m from the wrist, and the hand's 0.438 kg at 0.095 m: 49.9 N m.
        (
            "weight",
            [("[0.125, 0.015, 0.015]", "[0.125, 0.06, 0.06]")],
            "tools: rod_25cm: weighs 16 kg and loads wrist_flexion with 49.9 N m .* must be at most 7.1 N m",
        ),
        ("weight", [slice(HEAD, FOOT)], "tools: has 1 entries, must have at least 3"),
        (
            "com",
            [("position: [0.25, 0, 0], material: steel}", "position: [0.25, 0, 0], material: brass}")],
            "weighs 0.77827722",
        ),
        (
            "com",
            [("material: steel, looks_like: beech", "material: steel")],
            "looks unlike steel_far, must look the same",
        ),
        (
            "com",
            [("[0.05, 0, 0], material: beech}", "[0.05, 0, 0], material: beech, looks_like: steel}")],
            r"steel_far.components\[0\].looks_like: is 'steel', must be what it is made of, 'beech'",
        ),
        ("com", [slice(FOOT, None)], "has 2 entries, must have 3: two objects and the decoy"),
        ("novel", [("material: steel}", "material: brass}")], "stick: looks like brass, must look like what"),
        (
            "novel",
            [("material: steel}", "material: beech, looks_like: steel}")],
            r"stick.components\[1\].looks_like: is 'steel', must be what it is made of, 'beech'",
        ),
        ("novel", [("      wood: {position: [0, 0, 0]}\n", "")], "stick.grips: has 1 entries, must have 2"),
    ],
)
def test_objects_that_do_not_make_the_experiment_are_refused(tmp_path, name, changes, message):
    """Changes are of the tools file: a text by another, a part between two texts left out, or a material more."""
    models = tmp_path / "models"
    shutil.copytree(MODELS, models)
    path, materials = models / "tools" / f"{name}.yaml", models / "materials.yaml"
    text = path.read_text(encoding="utf-8")
    for change in changes:
        if isinstance(change, str):
            materials.write_text(materials.read_text(encoding="utf-8") + change, encoding="utf-8")
        elif isinstance(change, slice):
            start = text.index(change.start)
            text = text[:start] + ("" if change.stop is None else text[text.index(change.stop) :])
        else:
            assert change[0] in text
            text = text.replace(*change, 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadValueError, match=message):
        load_experiment("reach" if name == "novel" else name, models)
