"""Reports of protocols: from their own texts, or from their questions and measures."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import AffordanceError
from affordance.reporting.claims import Claim, ClaimCriterion
from affordance.reporting.section import PlainReport, ReportFigure, check_names, render_report

FACTS = {"repeats": 2, "camera_caption": "", "faults": "", "few_observers": "They are few."}
NUMBERS = {
    "mass": np.array([0.5, 1.25]),
    "mass_ci95": np.array([[0.4, 0.6], [1.0, 1.5]]),
    "share": 0.25,
    "densities": {"oak": 700.0, "<b>": 2.0},
    "nothing": None,
}
PROSE = """
order: 3
title: "Of {{ repeats }}"
summary: "Masses {{ mass | list }}."
figures: [{file: own.png, caption: "{{ camera_caption }}"}]
tables:
  - {caption: Names, header: [name, value], rows: "{% for name in names %}{{ name }} | 1\\n{% endfor %}"}
remarks: ["{{ few_observers }}"]
"""


def make(tmp_path, *, prose=None, given=None, claims=(), names=("mass", "share", "densities", "nothing")):
    section = None
    if prose is not None:
        section = tmp_path / "prose.yaml"
        section.write_text(prose, encoding="utf-8")
    return PlainReport(
        source=Path("mine.yaml"),
        prose=section,
        title="mine",
        question="What is it?",
        figures=(ReportFigure(file="drawn.png", caption="Drawn"),),
        meanings={name: "in kg" if name == "mass" else "" for name in names},
        given=given or {},
        claims=claims,
    )


def claim(value, **bounds):
    return Claim(
        key="key", source="ours", text="It is so.", criteria=[ClaimCriterion(name="size", value=value, **bounds)]
    )


def test_report_is_made_of_question_figures_and_every_number(tmp_path):
    section = render_report(make(tmp_path, claims=(claim("share", at_most=0.5),)), NUMBERS, FACTS)
    assert (section.title, section.summary, section.remarks) == ("mine", "What is it?", [])
    assert section.caution == "They are few."
    assert section.figures == [ReportFigure(file="drawn.png", caption="Drawn")]
    assert section.claims[0].met
    (table,) = section.tables
    assert table.header == ["number", "meaning", "value", "95 % interval"]
    assert table.rows == [
        ["mass", "in kg", "0.500, 1.25", "[0.400, 0.600], [1.00, 1.50]"],
        ["share", "", "0.250", ""],
        ["densities", "", "oak: 700, <b>: 2.00", ""],
        ["nothing", "", "none", ""],
    ]


def test_each_learner_and_people_have_a_row_and_long_lists_are_cut(tmp_path):
    numbers = {
        "learners": {"density": {"f": np.arange(20.0)}, "kinds_map": {"f": 1.0, "f_ci95": [0.5, 1.5]}},
        "people": {"f": 0.5},
    }
    (table,) = render_report(make(tmp_path, names=("f",)), numbers, FACTS).tables
    assert table.header == ["number", "of", "value", "95 % interval"]
    assert [row[1] for row in table.rows] == ["one density for each colour", "kinds, most probable", "people"]
    assert table.rows[0][2].endswith("10.0, 11.0, ... (20 in all)")
    assert table.rows[1][2:] == ["1.00", "[0.500, 1.50]"]


def test_texts_are_taken_as_they_stand(tmp_path):
    attack = "{{ cycler.__init__.__globals__ }} {% raw %} <script>"
    given = {
        "title": attack,
        "summary": attack,
        "remarks": [attack],
        "order": 7,
        "figures": [ReportFigure(file="a", caption=attack)],
    }
    section = render_report(make(tmp_path, given=given), NUMBERS, {**FACTS, "faults": "Faulty."})
    assert (section.order, section.title, section.summary) == (7, attack, attack)
    assert section.remarks == [attack, "Faulty."]
    assert section.figures == given["figures"]


def test_prose_of_a_section_is_filled_in_and_given_texts_take_its_place(tmp_path):
    facts = {**FACTS, "names": ["a | b", "{{ 7 * 7 }}\n{% x"]}
    section = render_report(make(tmp_path, prose=PROSE), NUMBERS, facts)
    assert (section.order, section.title, section.summary) == (3, "mine (as in Of 2)", "Masses 0.50, 1.25.")
    assert section.tables[0].rows == [["a | b", "1"], ["{{ 7 * 7 }} {% x", "1"]]
    other = render_report(make(tmp_path, prose=PROSE, given={"title": "Mine"}), NUMBERS, facts)
    assert (other.title, other.summary) == ("Mine", section.summary)


def test_experiment_of_ones_own_is_headed_by_its_name_and_after_which_it_is_told(tmp_path):
    report = make(tmp_path, prose=PROSE)
    assert render_report(report, NUMBERS, FACTS | {"names": []}).title == "mine (as in Of 2)"
    papers = replace(report, title=report.prose.stem)
    assert render_report(papers, NUMBERS, FACTS | {"names": []}).title == "Of 2"


def test_numbers_that_the_prose_needs_and_there_are_not_are_found_beforehand(tmp_path):
    known = {*FACTS, *NUMBERS, "names"}
    check_names(make(tmp_path, prose=PROSE), known)
    said = refuse(check_names, make(tmp_path, prose=PROSE), known - {"mass"})
    assert said.startswith("mine.yaml: report.section: is 'prose', whose summary names 'mass'")
    check_names(make(tmp_path, prose=PROSE, given={"summary": "Plain."}), known - {"mass"})
    assert "whose tables names 'names'" in refuse(check_names, make(tmp_path, prose=PROSE), known - {"names"})


def test_names_in_claims_are_found_beforehand(tmp_path):
    check_names(make(tmp_path, claims=(claim("max(mass) - share", at_most="share", above=0),)), NUMBERS)
    said = refuse(check_names, make(tmp_path, claims=(claim("share", at_most="2 * maas"),)), NUMBERS)
    assert said.startswith("mine.yaml: report.claims[0].criteria[0].at_most: names a number that is 'maas',")
    assert said.endswith("did you mean 'mass'?")


def test_claim_that_cannot_be_judged_names_file_and_key(tmp_path):
    with pytest.raises(AffordanceError, match=r"^mine.yaml: report.claims: .*mass\[7\]"):
        render_report(make(tmp_path, claims=(claim("mass[7]", above=0),)), NUMBERS, FACTS)


def test_prose_reaches_nothing_of_python(tmp_path):
    """Section files cannot reach Python's internals, although they are trusted."""
    for attack in ("{{ cycler.__init__.__globals__ }}", "{{ ''.__class__.__mro__ }}", "{{ mass.tofile('x') }}"):
        prose = f'{{order: 1, title: Bad, summary: "{attack}"}}'
        with pytest.raises(AffordanceError):
            render_report(make(tmp_path, prose=prose), {**NUMBERS, "mass": [0.5]}, FACTS)
