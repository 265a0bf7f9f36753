"""XML of strangers: entities, and more levels and elements than robots have, are refused in one line."""

import pytest
from helpers.refusals import refuse

from affordance.files.xml_file import read_xml

LAUGHS = '<!DOCTYPE a [<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {name} "{f"&{before};" * 10}">' for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (LAUGHS + "]><robot>&i;</robot>", "line 1: defines the entity 'a', must be expanded"),
        ('<!DOCTYPE a [\n<!ENTITY a SYSTEM "file:///etc/passwd">]><a>&a;</a>', "line 2: defines the entity 'a'"),
        ('<!DOCTYPE a [<!ENTITY % a SYSTEM "http://a.b/c"> %a;]><a/>', "line 1: defines the entity 'a'"),
        ("<a>\n<b>", "line 2, column 4: is not XML: no element found"),
        ("", "line 1, column 1: is not XML: no element found"),
        ('<?xml version="1.0" encoding="nonsense"?><a/>', "is not XML: unknown encoding"),
        ("<a>\n<b c='d\u202ee'/></a>", "line 2: has the attribute c with the hidden character U+202E"),
    ],
)
def test_what_is_no_xml_is_one_line(tmp_path, text, problem):
    path = tmp_path / "a.urdf"
    path.write_text(text, encoding="utf-8")
    assert f"a.urdf: {problem}" in refuse(read_xml, path, 1_000_000)


def test_bytes_are_counted(tmp_path):
    path = tmp_path / "a.urdf"
    path.write_text("<a><b/></a>")
    assert len(read_xml(path, 1000)) == 1
    assert "must have at most 1e-05 MB" in refuse(read_xml, path, 10)
