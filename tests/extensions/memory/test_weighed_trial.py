"""Weighings of tools are trials of a lasting memory."""

from pathlib import Path

import numpy as np
import pytest
from helpers.answers import answer

from affordance.belief.density_belief import Prior
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.weighed_trial import list_weighed_trials
from affordance.objects.load import load_tools

TOOLS = """tools:
  - name: club
    mass: 1.2
    mass_sd: 0.02
    components:
      - {cylinder: [0.02, 0.3], material: oak, mass: 0.28}
      - {semi_axes: [0.03, 0.03, 0.03], position: [0, 0, 0.15], material: steel}
"""


def test_memory_learns_what_bayes_rule_says_of_masses(tmp_path: Path) -> None:
    """Densities of both materials, given the mass of the whole and of a part, from the prior: normal, by hand."""
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS)
    (tool,) = load_tools(path)
    handle, head = (part.shape.volume for part in tool.components)
    with open_memory(tmp_path / "m.sqlite") as ledger:
        assert ledger.append(list(list_weighed_trials([tool], path))) == 2
        assert ledger.append(list(list_weighed_trials([tool], path))) == 0  # a weighing counts once
        belief = ledger.recall().belief
    prior = Prior()
    # The whole and the part are two things, each with a deviation of its own from the means.
    variances = [
        0.02**2 + prior.deviation**2 * (handle**2 + head**2),
        0.0028**2 + (prior.deviation * handle) ** 2,
    ]
    volumes = np.array([[handle, head], [handle, 0.0]])
    precision = np.eye(2) / prior.sd**2 + volumes.T @ np.diag(1.0 / np.array(variances)) @ volumes
    information = prior.mode / prior.sd**2 + volumes.T @ (np.array([1.2, 0.28]) / variances)
    np.testing.assert_allclose(
        np.sort(belief.untruncated_mean), np.sort(np.linalg.solve(precision, information)), rtol=0.02
    )


def test_command_teaches_weighings_to_a_memory(tmp_path: Path) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS)
    place = str(tmp_path / "m.sqlite")
    assert answer("memory", "weigh", place, path).lines == [f"{place}: 2 of 2 trials new, 2 in all"]
    said = answer("memory", "show", place).out
    assert "part 1 of club" in said
    assert "a scale" in said


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "    mass: 1.2\n    mass_sd: 0.02\n",
            "    mass_sd: 0.02\n",
            "tools[0].mass_sd: is the standard deviation of a mass, which is missing",
        ),
        (", mass: 0.28", ", mass: 0", "mass: is 0, must be"),
        (", mass: 0.28", ", mass: heavy", "mass: is 'heavy', must be"),
    ],
)
def test_wrong_weighings_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS.replace(old, new))
    assert said in answer("memory", "weigh", tmp_path / "m.sqlite", path, status=2).err
    assert not (tmp_path / "m.sqlite").exists()


def test_file_without_weighings_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS.replace(", mass: 0.28", "").replace("    mass: 1.2\n    mass_sd: 0.02\n", ""))
    said = "has no weighing, must have the mass (kg) of a tool or of a part"
    assert said in answer("memory", "weigh", tmp_path / "m.sqlite", path, status=2).err
