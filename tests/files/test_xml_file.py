"""XML of strangers: entities, and more levels and elements than robots have, are refused in one line."""

import pytest
from helpers.refusals import refuse

from affordance.files import xml_file
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
        ("<a>" * 300 + "</a>" * 300, "line 1: is more than 200 elements deep"),
        ("<a>\n<b>", "line 2, column 4: is not XML: no element found"),
        ("", "line 1, column 1: is not XML: no element found"),
        ('<?xml version="1.0" encoding="nonsense"?><a/>', "is not XML: unknown encoding"),
        ("<a>\n<b c='d\u202ee'/></a>", "line 2: has the attribute c with the hidden character U+202E"),
    ],
)
def test_what_is_too_much_or_no_xml_is_one_line(tmp_path, text, problem):
    path = tmp_path / "a.urdf"
    path.write_text(text, encoding="utf-8")
    assert f"a.urdf: {problem}" in refuse(read_xml, path, 1_000_000)


def test_elements_and_bytes_are_counted(tmp_path, monkeypatch):
    path = tmp_path / "a.urdf"
    path.write_text(f"<a>{'<b/>' * 9}</a>")
    monkeypatch.setattr(xml_file, "_MOST_ELEMENTS", 10)
    assert len(read_xml(path, 1000)) == 9
    path.write_text(f"<a>{'<b/>' * 10}</a>")
    assert "line 1: has more than 10 elements" in refuse(read_xml, path, 1000)
    assert "must have at most 1e-05 MB" in refuse(read_xml, path, 10)
