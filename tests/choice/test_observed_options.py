import dataclasses

import numpy as np
from helpers.two_tools import STICK

from affordance.choice.observed_options import list_options
from affordance.objects.tool import find_free_end


def test_options_are_the_grips_as_seen():
    options = list_options(STICK)
    assert [option.name for option in options] == ["stick by wood", "stick by steel"]
    for option in options:
        np.testing.assert_allclose(find_free_end(option.gripped), [0.3, 0, 0], atol=1e-12)
    assert options[0].features is options[1].features  # it is looked at once
    (whole,) = list_options(dataclasses.replace(STICK, grips=()))
    assert whole.name == "stick"
