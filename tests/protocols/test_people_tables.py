import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.protocols.people_tables import load_published

HEADER = "quantity,value,low,high,unit,source\n"


def test_tables_of_people_name_what_is_missing(tmp_path):
    path = tmp_path / "people.csv"
    assert "cannot be read: No such file" in refuse(load_published, path)
    path.write_bytes(b"\xff\xfe\x00")
    assert "is not a text file in UTF-8" in refuse(load_published, path)
    path.write_text(HEADER + "frist_N,1,,,N,x\n")
    with pytest.raises(BadValueError, match=r"has no row 'first_N', which is needed; .* nearest is 'frist_N'"):
        load_published(path).get("first_N")
