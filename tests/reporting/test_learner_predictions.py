import math

import numpy as np
import pytest

from affordance.reporting import learner_predictions as prediction


def test_contrasts_are_those_of_two_normal_samples():
    rng = np.random.default_rng(5)
    one, other = rng.normal(0.0, 1.0, 1000), rng.normal(1.0, 1.0, 1000)
    predictions = {"m": {"density": prediction.summarise(one), "kinds_map": prediction.summarise(other)}}
    (contrast,) = prediction.contrast_learners(predictions)
    assert contrast.effect == pytest.approx(1.0, abs=0.1)
    assert contrast.superiority == pytest.approx(0.760, abs=0.03)  # Phi(1 / sqrt 2)
    assert contrast.num_people == pytest.approx(22, abs=4)  # 2 (1.960 + 1.282)^2
    (wider,) = prediction.contrast_learners(predictions, {"m": math.sqrt(3.0)})
    assert wider.effect == pytest.approx(0.5 * contrast.effect, rel=0.03)
    assert wider.superiority == pytest.approx(0.638, abs=0.03)


def test_learners_that_do_the_same_are_not_told_apart():
    same = {learner: prediction.summarise(np.ones(5)) for learner in ("density", "kinds_map")}
    (contrast,) = prediction.contrast_learners({"first_N": same})
    assert contrast.superiority == 0.5
    assert math.isinf(contrast.num_people)
    text = prediction.format_predictions({}, {"first_N": same}, [contrast])
    assert "density and kinds_map are not distinguished by any of these" in text


def test_learners_that_differ_by_less_than_observers_do_are_not_told_apart():
    drawn = np.random.default_rng(5).normal(0.0, 1.0, 1000)
    alike = {"density": prediction.summarise(drawn), "kinds_map": prediction.summarise(drawn + 0.001)}
    (contrast,) = prediction.contrast_learners({"first_N": alike})
    text = prediction.describe_contrast(contrast)
    assert text.startswith("density and kinds_map are not distinguished by any of these: they differ most in first_N")
    assert "it would take more than 100000 participants per group (two-sided .05, power .9) if people differ" in text
