import pickle

import pytest

from affordance.exceptions import BadValueError, ModelFileError


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            BadValueError("a.yaml", "tools[0].name", "is\n3,  must be a text"),
            "a.yaml: tools[0].name: is 3, must be a text",
        ),
        (BadValueError("--jobs", "", "is 0"), "--jobs: is 0"),
        (ModelFileError("arm.sdf", "line 1\n  line 2"), "arm.sdf: line 1 line 2"),
    ],
)
def test_errors_are_one_line_and_cross_processes(error, text):
    assert str(error) == text
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == text
