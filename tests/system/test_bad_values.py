"""Bad values of files, settings and command lines: one line names place, value and bound, and nothing is written.

The tables in ``bad_values/`` have a line for each: what is changed in a good value, and what the answer must say.
"""

from pathlib import Path

import pytest
from helpers.bad_values import Row, is_said, list_rows, refuse


@pytest.mark.parametrize("row", list_rows())
def test_bad_value_is_refused_in_one_line(row: Row, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    answer = refuse(row)
    assert is_said(row.message, answer), answer
