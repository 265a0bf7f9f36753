"""Mistakes in what commands that run experiments share: the experiment, numbers, settings, faults and the robot."""

from pathlib import Path

import pytest
from helpers.refusals import refuse_command


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "run wieght",
            "experiment: is 'wieght', must be one of all, weight, com, reach, hammer, vision, linear_plus,",
        ),
        ("predict vision", "experiment: is 'vision', which uses one learner for all observers"),
        ("predict linear_pluss", "did you mean 'linear_plus'?"),
        ("watch wieght", "experiment: is 'wieght', must be one of weight, com, reach, hammer"),
        ("run --repeats 0", "--repeats: is 0, must be from 1 to 100000; the nearest is 1"),
        ("run --repeats -5", "--repeats: is -5, must be from 1 to 100000; the nearest is 1"),
        ("run --repeats many", "--repeats: is 'many', must be a whole number"),
        ("run --repets 3", "; did you mean '--repeats'?"),
        ("predict weight --repeats 1", "--repeats: is 1, must be at least 2"),
        ("run --seed -1", "--seed: is -1, must be from 0 to 4294967295; the nearest is 0"),
        ("run --seed 4294967296", "--seed: is 4294967296, must be from 0 to 4294967295"),
        ("run --jobs 0", "--jobs: is 0, must be from 1 to "),
        ("run --jobs 5000", "--jobs: is 5000, must be from 1 to "),
        ("run --set prior.sd=1 --set prior.sd=2", "--set: prior.sd: is given twice"),
        ("run --set prior.sb=3", "settings: prior.sb: is 'prior.sb', must be one of prior.mode, prior.sd, prior.dev"),
        ("run weight --set prior.sd=-1", "settings: prior.sd: is -1, must be from 0.001 to 1e+12"),
        ("predict linear_plus --set prior.sb=1", "settings: prior.sb: is 'prior.sb', must be one of prior.mode"),
        ("run --set faults.stuck_joint=knee", "stuck_joint: is 'knee', must be one of shoulder_azimuth"),
        ("run linear_plus --set noise.model=white", "noise: is WhiteNoise, must be WeberNoise for lifts"),
        ("run --vision ears", "--vision: is 'ears', must be one of features, pixels"),
        ("run linear_plus --vision pixels", "--vision: is 'pixels', must be 'features' for linear_plus"),
        ("run weight --fault gremlins", "--fault: is 'gremlins', must be one of nan_samples, "),
        ("run linear_plus --fault bias", "--fault: is given, must be omitted for linear_plus"),
        ("run --robot nowhere", "--robot: is 'nowhere', which is neither a folder nor a robot's file"),
        (
            "run weight --learner kinds_map --set learner=density",
            "--set: learner: is given together with --learner, must be given once",
        ),
        (
            "run linear_plus --learner density",
            "--learner: has no effect on linear_plus, which always simulates",
        ),
        (
            "predict weight --set learner=kinds_map",
            "--learner: has no effect on predict, which always simulates density, kinds_map, kinds_drawn",
        ),
    ],
)
def test_mistake_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command(*words.split())
