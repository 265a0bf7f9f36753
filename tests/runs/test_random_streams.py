import ast
import re
from pathlib import Path

import numpy as np

from affordance.runs.random_streams import Stream
from studies.random_streams import StudyStream

ROOT = Path(__file__).parents[2]
STREAMS = (*Stream, *StudyStream)
# A number of trials that no observer has.
MOST_TRIALS = 10**4


def test_streams_draw_different_numbers():
    draws = {np.random.default_rng([0, stream]).random() for stream in STREAMS}
    assert len(draws) == len(STREAMS)


def test_streams_are_no_trials_except_for_those_that_follow_the_seed_of_a_trial():
    assert [*Stream][:3] == [Stream.SEEING, Stream.SENSING, Stream.CONTROL]
    assert min(STREAMS[3:]) > MOST_TRIALS


def test_a_trailing_zero_adds_nothing_to_a_seed():
    """A trailing zero leaves a seed's numbers the same, so that the numbers of streams must differ."""
    assert np.random.default_rng([0, Stream.SHOWN]).random() == np.random.default_rng([0, Stream.SHOWN, 0]).random()


def test_streams_are_numbered_nowhere_else():
    found = []
    for path in sorted(path for folder in ("affordance", "studies") for path in (ROOT / folder).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "10**" in text else ():
            is_power = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)
            if is_power and re.fullmatch(r"10 \*\* [5-9]", ast.unparse(node)):
                found.append(path.name)
    assert set(found) == {"random_streams.py"}
