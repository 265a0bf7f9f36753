"""Text of a payload: the answer first, tables and sentences in the terminal's width, small numbers as 0."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.payload_text import describe_payload
from affordance.extensions.payload.posterior.payload_belief import Marginals
from affordance.extensions.robots.recorded_arm import Flange

_MEAN = np.array([0.5522, 1e-5, -2e-5, 0.1, 2e-4, 3e-4, 4e-4, 1e-8, 0.0, 0.0])
_SD = np.array([0.0082, 2e-4, 3e-4, 0.0017, *[5e-5] * 6])
_LONG = "a sentence that goes on and on, " * 8


def _believe(**changes):
    marginals = Marginals(_MEAN, _SD, _MEAN - 0.7 * _SD, _MEAN + 0.7 * _SD, _MEAN - 1.6 * _SD, _MEAN + 1.6 * _SD)
    setting = PayloadSetting(_MEAN[0], _MEAN[1:4], _MEAN[4:])
    content = {
        "source": "run.csv",
        "analysis": "paired",
        "doubts": (),
        "shows_mass": True,
        "is_light": False,
        "mass": _MEAN[0],
        "mass_sd": _SD[0],
        "mass_interval90": (0.54, 0.56),
        "centre_of_mass": _MEAN[1:4],
        "marginals": marginals,
        "tip": "tip",
        "halves": None,
        "unseen": (),
        "learned": (),
        "notes": (_LONG,),
        "assumptions": (),
        "warnings": (),
        "setting": setting,
        "advice": "",
    }
    return SimpleNamespace(**(content | changes))


def _describe(belief, width=0, flange=None):
    X_FT = np.eye(4)
    X_FT[2, 3] = 0.003
    flange = Flange("tool0", X_FT) if flange is None else flange
    return describe_payload(belief, (), flange, materials={}, taught="", anyway=False, width=width)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({}, "0.5522 kg +- 8.2 g, centre of mass (0, 0, 103) +- 1.7 mm in tool0: trusted"),
        ({"doubts": ("x",)}, "0.5522 kg +- 8.2 g, centre of mass (0, 0, 103) +- 1.7 mm in tool0: NOT TO BE TRUSTED"),
        ({"shows_mass": False}, "0.5522 kg +- 8.2 g, centre of mass (0, 0, 103) +- 1.7 mm in tool0: NOT SEEN"),
        ({"is_light": True}, "Little or nothing is held, 0.54 to 0.56 kg: trusted"),
    ],
)
def test_the_answer_is_in_the_first_line_in_the_frame_of_the_flange(changes, says):
    assert _describe(_believe(**changes)).splitlines()[0] == says


def test_without_a_flange_the_answer_is_in_the_frame_of_the_tip():
    assert "(0, 0, 100) +- 1.7 mm in tip: trusted" in _describe(_believe(), flange="controllers do not know it")


def test_tables_and_sentences_fit_the_terminal_and_lines_to_paste_stay_whole():
    text = _describe(_believe(), width=80)
    above, lines = text.split("For the robot")
    assert max(map(len, above.splitlines())) <= 80
    assert " ".join(above.split()).count(" ".join(_LONG.split())) == 1
    assert any(len(line) > 80 for line in lines.splitlines())
    assert _LONG.strip() in _describe(_believe())


def test_what_a_table_does_not_show_is_0():
    (row,) = [line for line in _describe(_believe()).splitlines() if line.startswith("centre x")]
    assert row.split()[2:4] == ["0", "0.0002"]
    assert not re.search(r"\de-\d", _describe(_believe()).partition("For the robot")[0])
