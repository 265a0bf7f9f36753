import dataclasses

import numpy as np
import pytest
from helpers.two_tools import REACH, STICK

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.ranking import rank, rank_options
from affordance.extensions.pixels.pixel_eye import PIXELS
from affordance.objects.load import load_tools
from affordance.objects.tool import find_free_end
from affordance.settings import DEFAULT_SETTINGS


def test_options_are_the_grips_as_seen():
    options = list_options(STICK)
    assert [option.name for option in options] == ["stick by wood", "stick by steel"]
    for option in options:
        np.testing.assert_allclose(find_free_end(option.gripped), [0.3, 0, 0], atol=1e-12)
    assert options[0].features is options[1].features  # it is looked at once
    (whole,) = list_options(dataclasses.replace(STICK, grips=()))
    assert whole.name == "stick"


def test_ends_that_are_alike_are_one_option(tmp_path):
    """A bar's ends are one, also in Python; an end that is rolled, whose other side points up, is another one."""
    path = tmp_path / "tools.yaml"
    path.write_text(
        """tools:
  - name: bar
    components:
      - {box: [0.3, 0.03, 0.02], material: oak}
    grips:
      left: {position: [-0.12, 0, 0]}
      right: {position: [0.12, 0, 0], rpy_deg: [0, 0, 180]}
      rolled: {position: [0.12, 0, 0], rpy_deg: [90, 0, 180]}
      middle: {position: [0, 0, 0]}
"""
    )
    (bar,) = load_tools(path)
    ranking = rank(list_options(bar), REACH, MaterialMemory(), num_samples=200)
    alike = {each.option.grip: each.option.alike for each in ranking.ranked}
    assert alike == {"left": ("right",), "rolled": (), "middle": ()}
    works = {each.option.grip: each.work for each in ranking.ranked}
    (right,) = rank(list_options(bar)[1:2], REACH, MaterialMemory(), num_samples=200).ranked
    assert right.work == pytest.approx(works["left"], rel=1e-4)


def test_stick_seen_in_a_picture_is_all_but_a_matter_of_chance():
    """Either grip is best with a probability of 0.5; the stick's parts are seen a fraction of a millimetre off axis.

    Apart from sampling errors, one half may look a percent larger than the other.
    """
    settings = dataclasses.replace(DEFAULT_SETTINGS, eye=PIXELS)
    options = list_options(STICK, seed=1, eye=settings.eye)
    choice = plan_choice(options, REACH, settings)
    assert all(part.X_TE[1, 3] != 0.0 and len(part.deformations) == 9 for part in choice.options[0].features)
    ranking = rank_options(choice, MaterialMemory(), np.random.default_rng(0), 5_000)
    assert ranking.best.p_best == pytest.approx(0.5, abs=0.01 + 3 * 0.5 / np.sqrt(5_000))
    one, other = ranking.ranked
    assert one.work == pytest.approx(other.work, rel=0.01)
