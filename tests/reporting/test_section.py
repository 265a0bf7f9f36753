"""Section files: prose as templates and claims as data, filled in with numbers."""

import numpy as np
import pytest
import yaml

from affordance.reporting.claims import ReportFigure
from affordance.reporting.section import Table, load_claims, render_section

FILE = """
order: 4
title: "About the {{ first }}"
summary: >-
  {{ repeats | observers }} {{ "was" if repeats == 1 else "were" }} simulated,
  in folded   lines.
figures:
  - file: figure.png
    caption: "The {{ first }}."
  - file: seen.png
    caption: "{{ camera_caption }}"
claims:
  - key: small
    source: paper
    text: "The {{ first }} is small."
    criteria:
      - {name: "size of the {{ first }}", value: "size", at_most: 0.1, unit: "cm", scale: 100, digits: 1}
      - {name: "grip", value: "grip", is: "expected_grip"}
tables:
  - caption: "Sizes of {{ sizes | length }}."
    header: [name, "size ({{ unit }})"]
    rows: |
      {% for name, size in sizes.items() %}
      {{ name }} | {{ size | fixed }}
      {% endfor %}
remarks:
  - "Is {{ size | cm }}, or {{ size | percent(1) }}, or {{ size | number(2) }}."
  - "{{ few_observers }}"
"""
NUMBERS = {"size": 0.0625, "sizes": {"rod, short": 0.5, "Öl-Stab <b>": 0.123}, "grip": "wood"}
FACTS = {
    **{"first": "stick", "repeats": 2, "camera_caption": "What was seen.", "unit": "m", "expected_grip": "wood"},
    "few_observers": "They are few.",
}


@pytest.fixture
def file(tmp_path):
    def write(text=FILE):
        path = tmp_path / "stick.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_every_text_is_filled_in(file):
    section = render_section(file(), NUMBERS, FACTS)
    assert (section.order, section.title) == (4, "About the stick")
    assert section.summary == "2 observers were simulated, in folded lines."
    assert section.figures == [
        ReportFigure(file="figure.png", caption="The stick."),
        ReportFigure(file="seen.png", caption="What was seen."),
    ]
    (claim,) = section.claims
    assert (claim.key, claim.source, claim.text, claim.met) == ("small", "paper", "The stick is small.", True)
    assert tuple(claim.criteria[0]) == ("size of the stick", "6.2 cm", "at most 10 cm", True)
    assert tuple(claim.criteria[1]) == ("grip", "wood", "wood", True)
    rows = [["rod, short", "0.50"], ["Öl-Stab <b>", "0.12"]]
    assert section.tables == [Table("Sizes of 2.", ["name", "size (m)"], rows)]
    assert section.remarks == ["Is 6.25 cm, or 6.2 %, or 0.062.", "They are few."]


def test_claims_follow_the_numbers(file):
    (claim,) = render_section(file(), {**NUMBERS, "size": 0.2}, FACTS).claims
    assert not claim.met
    assert [criterion.met for criterion in claim.criteria] == [False, True]
    (claim,) = render_section(file(), NUMBERS, {**FACTS, "expected_grip": "steel"}).claims
    assert [criterion.met for criterion in claim.criteria] == [True, False]


def test_what_comes_out_empty_is_left_out(file):
    section = render_section(
        file(), {**NUMBERS, "sizes": {}}, {**FACTS, "few_observers": "", "camera_caption": " ", "repeats": 1}
    )
    assert section.summary.startswith("1 observer was")
    assert [figure.file for figure in section.figures] == ["figure.png"]
    assert section.tables == []
    assert len(section.remarks) == 1


def test_arrays_are_numbers_like_lists(file):
    text = FILE.replace('"size", at_most', '"max(lengths)", at_most').replace("size | cm", "lengths[1] | cm")
    for lengths in ([0.01, 0.09], np.array([0.01, 0.09])):
        section = render_section(file(text), {**NUMBERS, "lengths": lengths}, FACTS)
        assert section.claims[0].criteria[0].value == "9.0 cm"
        assert section.remarks[0].startswith("Is 9.00 cm")


def test_claims_are_read_as_data(file):
    (claim,) = load_claims(file())
    assert (claim.key, claim.source, claim.text) == ("small", "paper", "The {{ first }} is small.")
    first, second = claim.criteria
    assert (first.value, first.bounds) == ("size", {"at_most": 0.1})
    assert (first.unit, first.scale, first.digits) == ("cm", 100, 1)
    assert (second.value, second.bounds) == ("grip", {"is": "expected_grip"})
    assert (second.unit, second.scale, second.digits) == ("", 1.0, 2)
    assert load_claims(file("order: 1\ntitle: Without\nsummary: claims\n")) == ()


def test_section_of_title_and_summary_alone_is_one(file):
    section = render_section(file(yaml.safe_dump({"order": 1, "title": "Bare", "summary": "Nothing."})), {}, {})
    assert section[:3] == (1, "Bare", "Nothing.")
    assert not any(section[3:])
