import pytest

from affordance.exceptions import BadValueError
from affordance.protocols.published import load_published

HEADER = "quantity,value,low,high,unit,source\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "row 1: names the columns nothing, must be quantity, value, low, high, unit, source"),
        ("quantity,value\n", "row 1: names the columns quantity, value, must be"),
        (HEADER + "f,1,0\n", "row 2: has 3 columns, must have 6"),
        (HEADER + "f,abc,,,1,x\n", "row 2, value: is 'abc', must be a finite number"),
        (HEADER + "f,1,0,nan,1,x\n", "row 2, high: is 'nan', must be a finite number"),
        (HEADER + "f,1,0,,1,x\n", "row 2, high: is empty, must be given as the other end is"),
        (HEADER + "f,1,2,3,1,x\n", "row 2, low: is 2, must be at most the value 1"),
        (HEADER + "f,1,0,0.5,1,x\n", "row 2, high: is 0.5, must be at least the value 1"),
        (HEADER + "f,1,,,,x\n", "row 2, unit: is empty, must be given"),
        (HEADER + "f,1,,,1, \n", "row 2, source: is empty, must be given"),
        (HEADER + "f,1,,,1,x\nf,2,,,1,x\n", "row 3, quantity: is 'f', which an earlier row has"),
        (HEADER + ",1,,,1,x\n", "row 2, quantity: is '', must be a name"),
        (HEADER + 'f,1,,,1,"x\n', "is not a table of comma-separated values"),
    ],
)
def test_tables_of_people_name_what_is_wrong(text, message, tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadValueError) as error:
        load_published(path)
    assert f"people.csv: {message}" in str(error.value)
    assert "\n" not in str(error.value)


def test_tables_of_people_name_what_is_missing(tmp_path):
    path = tmp_path / "people.csv"
    with pytest.raises(BadValueError, match="cannot be read: No such file"):
        load_published(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadValueError, match="is not a text file in UTF-8"):
        load_published(path)
    path.write_text(HEADER + "frist_N,1,,,N,x\n")
    with pytest.raises(BadValueError, match=r"has no row 'first_N', which is needed; .* nearest is 'frist_N'"):
        load_published(path).get("first_N")
