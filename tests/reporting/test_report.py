import pytest

from affordance.reporting.report import Claim, Picture, Section, write_report, write_section


def make_section(order, title, met=True):
    return Section(
        order=order,
        title=title,
        summary="Objects <held> & felt.",
        pictures=[Picture("figure.png", "Figure 3 & more")],
        claims=[Claim("IV-A", "The drop is reduced.", met, "18 to 0.2 cm")],
        differences=["No constants are given."],
    )


@pytest.fixture
def folder(tmp_path):
    for name in ("weight", "com"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "figure.png").write_bytes(b"\x89PNG")
    return tmp_path


def test_report_holds_all_sections_in_the_papers_order(folder):
    write_section(folder / "weight", make_section(1, "Simulation I"))
    write_section(folder / "com", make_section(2, "Simulation II", met=False))
    (folder / "weight" / "replay.html").write_text("a replay")
    page = write_report(folder).read_text()
    assert page.index("Simulation I<") < page.index("Simulation II<")
    assert page.count(">met<") == 1
    assert page.count(">not met<") == 1
    assert "18 to 0.2 cm" in page
    assert "Objects &lt;held&gt; &amp; felt." in page
    assert "data:image/png;base64,iVBORw==" in page
    assert "weight/replay.html" in page
    assert "com/replay.html" not in page  # there is none


@pytest.mark.parametrize("text", ["", "{", "[]", '{"order": 2}', "\x00"])
def test_section_that_cannot_be_read_is_named_and_left_out(folder, caplog, text):
    write_section(folder / "weight", make_section(1, "Simulation I"))
    (folder / "com" / "section.json").write_text(text)
    assert "Simulation I<" in write_report(folder).read_text()
    assert "com/section.json is left out" in caplog.text


def test_report_of_nothing_is_still_a_page(tmp_path):
    assert "</html>" in write_report(tmp_path).read_text()
