"""The page that is made of the sections of a folder."""

import functools
import html.parser
import json
import operator
import re

import pytest

from affordance.reporting.claims import ClaimResult, CriterionResult
from affordance.reporting.report import OWN_MODELS, remove_section, write_report, write_section
from affordance.reporting.section import ReportFigure, Section, Table


def make_section(order, title, met=True):
    criteria = (
        CriterionResult("drop, last over first", "0.012", "at most 0.25", met),
        CriterionResult("growth of the mass", "0.20, 0.20 kg", "above 0 kg", True),
    )
    return Section(
        order=order,
        title=title,
        summary="Objects <held> & felt.",
        figures=[ReportFigure(file="figure.png", caption="Figure 3 & more")],
        claims=[ClaimResult("drop", "IV-A", "The drop is reduced.", met, criteria)],
        tables=[Table("Trial by trial.", ["object", "drop (cm)"], [["rod <1>", "18"], ["rod 2", "0.2"]])],
        remarks=["No constants are given."],
    )


@pytest.fixture
def folder(tmp_path):
    for name in ("weight", "com"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "figure.png").write_bytes(b"\x89PNG")
    return tmp_path


class Page(html.parser.HTMLParser):
    """Identities, links and table rows of a page, with a check that its tags are closed."""

    VOID = ("meta", "img", "br", "link", "input")

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.open, self.rows = [], [], [], 0
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.links += [attributes["href"]] if "href" in attributes else []
        self.rows += tag == "tr"
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def write_page(folder):
    return write_report(folder).read_text(encoding="utf-8")


def write_both(folder):
    write_section(folder / "weight", make_section(1, "Simulation I"))
    write_section(folder / "com", make_section(2, "Simulation II", met=False))
    return write_page(folder)


def write_metrics(folder, name, **changes):
    setup = {"arm": "arm.dmd.yaml", "models": "my_models", "learners": ["density"], "settings": {}, **changes}
    numbers = {
        "repeats": 20,
        "seed": 3,
        "finished": "2026-11-22",
        "versions": {"affordance": "0.2.0", "drake": "1.58.0"},
        **({} if changes == {"setup": None} else {"setup": setup}),
    }
    (folder / name / "metrics.json").write_text(json.dumps(numbers), encoding="utf-8")


def test_report_holds_all_sections_in_the_papers_order(folder):
    (folder / "weight" / "replay.html").write_text("a replay", encoding="utf-8")
    page = write_both(folder)
    assert page.index("<h2>Simulation I<") < page.index("<h2>Simulation II<")
    assert "drop, last over first: <b>0.012</b> (at most 0.25)" in page
    assert "Objects &lt;held&gt; &amp; felt." in page
    assert "<td>rod &lt;1&gt;</td><td>18</td>" in page
    assert 'title">Trial by trial.</p>' in page
    assert "<li>No constants are given.</li>" in page
    assert "data:image/png;base64,iVBORw==" in page
    assert 'href="./weight/replay.html"' in page
    assert "com/replay.html" not in page  # there is none
    # The criterion that is not met is marked.
    assert page.count("✗") == 1
    assert re.search(r"0\.012</b> \(at most 0\.25\) <span[^>]*>✗", page)


def test_report_opens_with_what_it_is_and_each_section_with_badge_finding_and_figure(folder):
    write_section(folder / "weight", make_section(1, "Simulation I")._replace(finding="It sinks by 3 cm."))
    write_section(folder / "com", make_section(2, "Simulation II", met=False))
    page = write_page(folder)
    assert page.index("A simulated robot looks at an object") < page.index("<section")
    assert '1 of 2 claims are met; not met: <a href="#com-drop">The drop is reduced.</a> ' in page
    assert '<tr id="com-drop">' in page
    assert [text for _, text in re.findall(r'badge (met|not)">(.*?)<', page)] == [
        "1 of 1 claims met",
        "0 of 1 claims met",
    ]
    assert re.findall(r'"finding">(.*?)<', page) == ["It sinks by 3\u00a0cm.", "Objects &lt;held&gt; &amp; felt."]
    for section in page.split("<section")[1:]:
        # All but that is one click away.
        places = [section.index(text) for text in ("badge", '"finding"', "<img", "<details>", "The drop is reduced.")]
        assert places == sorted(places)


def test_shares_of_settings_are_those_of_the_study(folder, monkeypatch, tmp_path):
    kept = tmp_path / "kept.json"
    monkeypatch.setattr("affordance.reporting.report._ROBUSTNESS", kept)
    assert "of settings" not in write_both(folder)
    assert "other settings" not in write_both(folder)
    kept.write_text(
        json.dumps({"settings": 300, "claims": {"weight.drop": {"holds": 0.614}, "com.other": {"holds": 0.5}}})
    )
    for changes in ({}, {"models": OWN_MODELS, "settings": {"prior.sd": 8000.0}}):  # other objects, other settings
        write_metrics(folder, "weight", **changes)
        assert "of settings" not in write_both(folder)
        assert "other settings" not in write_both(folder)
    write_metrics(folder, "weight", models=OWN_MODELS)
    page = write_both(folder)
    assert page.count("Holds in 61\u00a0% of settings.") == 1
    assert " ".join(page.split()).count("over 300 other settings, the claim holds in 61 %<") == 1
    assert page.count("other settings") == 1


@pytest.mark.parametrize("is_clone", [True, False])
def test_head_leads_to_the_page_about_trust_in_a_clone_only(folder, monkeypatch, tmp_path, is_clone):
    trust = (folder.parent if is_clone else tmp_path / "elsewhere") / "docs" / "trust.md"
    trust.parent.mkdir(parents=True, exist_ok=True)
    trust.touch()
    monkeypatch.setattr("affordance.reporting.report._TRUST", trust)
    page = write_both(folder)
    assert ('<a href="../docs/trust.md">How far to trust it</a>' in page) == is_clone
    assert (
        "listed in the project&#39;s docs/trust.md" in page or "listed in the project's docs/trust.md" in page
    ) != is_clone


def test_contents_point_to_every_section(folder):
    page = Page(write_both(folder))
    assert page.open == []
    assert [each for each in page.ids if "-" not in each] == ["weight", "com"]
    assert [link for link in page.links if link.startswith("#") and "-" not in link] == ["#weight", "#com"]
    assert "<nav>" in (folder / "report.html").read_text(encoding="utf-8")


def test_anchor_is_of_the_folders_name(tmp_path):
    write_section(tmp_path / "My results (2)", make_section(1, "Simulation I")._replace(figures=[]))
    assert Page(write_page(tmp_path)).ids[0] == "my-results-2-"


def test_caution_stands_beside_the_outcome(tmp_path):
    (tmp_path / "weight").mkdir()
    section = make_section(1, "Simulation I")._replace(figures=[], finding="It sinks.", caution="Of 2 <only>.")
    write_section(tmp_path / "weight", section)
    assert 'It sinks. <span class="caution">Of 2 &lt;only&gt;.</span></p>' in write_page(tmp_path)


def test_run_is_named_with_observers_seed_versions_and_time(folder):
    for name in ("weight", "com"):
        write_metrics(folder, name, setup=None)
    line = "20 repeats, seed 3, by version 0.2.0 with Drake 1.58.0, 2026-11-22"
    assert f"com, weight: {line}<" in write_both(folder)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"repeats": 3}', '{"versions": []}'])
def test_numbers_that_do_not_say_what_was_run_leave_the_report_without(folder, text):
    (folder / "weight" / "metrics.json").write_text(text, encoding="utf-8")
    assert " repeats, seed" not in write_both(folder)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"order": 2}', "\x00", "[" * 100_000])
def test_section_that_is_none_is_named_and_quarantined(folder, caplog, text):
    write_section(folder / "weight", make_section(1, "Simulation I"))
    (folder / "com" / "section.json").write_text(text, encoding="utf-8")
    page = write_page(folder)
    assert "<h2>Simulation I<" in page
    assert "com/section.json is left out of the report: it is not a section" in caplog.text
    assert (folder / "com" / "section.broken").read_text(encoding="utf-8") == text
    assert not (folder / "com" / "section.json").exists()


@pytest.mark.parametrize(
    "place",
    [
        ("order",),
        ("title",),
        ("summary",),
        ("figures",),
        ("figures", 0, "caption"),
        ("claims", 0),
        ("claims", 0, "met"),
        ("claims", 0, "text"),
        ("claims", 0, "criteria"),
        ("claims", 0, "criteria", 0, "bound"),
        ("tables", 0, "header"),
        ("tables", 0, "rows", 1, 0),
        ("remarks", 0),
    ],
)
def test_whatever_stands_in_a_section_the_others_are_reported(folder, caplog, place):
    """A section with values of other kinds, or with keys left out or unknown, is omitted, and others are reported."""
    caplog.set_level("ERROR")
    write_both(folder)
    path = folder / "com" / "section.json"
    good = path.read_text(encoding="utf-8")
    *outer, last = place
    for other in (None, 3.5, [None], {"a": 1}, "left out"):
        content = json.loads(good)
        entry = functools.reduce(operator.getitem, outer, content)
        entry[last] = other
        if other == "left out":
            del entry[last]
        path.write_text(json.dumps(content), encoding="utf-8")
        page = write_page(folder)
        assert "<h2>Simulation I<" in page
        assert path.exists() == ('<section id="com">' in page)
        assert path.exists() == (other == "left out" and isinstance(last, int))


@pytest.mark.parametrize("file", ["../secret.png", "/etc/passwd", "deep/figure.png"])
def test_figure_that_lies_elsewhere_is_not_carried_into_the_page(folder, caplog, file):
    write_section(folder / "com", make_section(2, "Simulation II"))
    path = folder / "com" / "section.json"
    path.write_text(path.read_text(encoding="utf-8").replace("figure.png", file), encoding="utf-8")
    assert "Simulation II" not in write_page(folder)
    assert "figures.0.file: is " in caplog.text


def test_section_whose_figure_is_missing_is_named_left_out_and_kept(folder, caplog):
    write_both(folder)
    (folder / "com" / "figure.png").unlink()
    page = write_page(folder)
    assert "<h2>Simulation I<" in page
    assert "Simulation II" not in page
    assert "com/section.json is left out of the report: it cannot be read" in caplog.text
    assert (folder / "com" / "section.json").exists()


def test_section_that_no_longer_holds_is_taken_out(folder):
    assert "Simulation II" in write_both(folder)
    remove_section(folder / "com")
    remove_section(folder / "com")
    assert "Simulation II" not in write_page(folder)


def test_report_of_nothing_is_still_a_page(tmp_path):
    page = write_page(tmp_path)
    assert Page(page).open == []
    assert "0 of 0 claims" in page


def test_head_names_arm_models_learner_and_changed_settings(folder):
    for name in ("weight", "com"):
        write_metrics(folder, name, settings={"prior.sd": 8000.0, "uses_posterior": True})
    page = write_both(folder)
    said = (
        "the arm arm.dmd.yaml of my_models; one density for each colour; changed settings: prior.sd = 8000, "
        "uses_posterior ="
    )
    assert f"com, weight</b>: {said} true; 20 repeats, seed 3" in page
    assert page.index(said) < page.index("<section")
    assert "One noise model, one prior" in page


def test_head_tells_runs_apart_that_differ(folder):
    write_metrics(folder, "weight", models=OWN_MODELS, learners=["density", "kinds_map"])
    write_metrics(folder, "com", settings={"noise.model": "white"})
    page = write_both(folder)
    arm = "the arm arm.dmd.yaml of my_models"
    assert f"com</b>: {arm}; one density for each colour; changed settings: noise.model = white;" in page
    assert (
        "weight</b>: the paper&#39;s arm; one density for each colour; kinds, most probable; no setting changed;"
        in page
    )
    assert "One noise model, one prior" not in page


def find_heading(page):
    (title,), (heading,) = re.findall("<title>(.*?)</title>", page), re.findall("<h1>(.*?)</h1>", page)
    assert title == heading
    return heading


def test_only_the_papers_simulations_are_headed_as_the_papers(folder):
    """An edited copy is headed by its own title, although its claims still name the paper as their source."""
    claims = [claim._replace(source="paper IV-A, figure 3") for claim in make_section(1, "").claims]
    section = make_section(1, "My experiment")._replace(figures=[], claims=claims)

    def find() -> str:
        return find_heading(write_page(folder)).removeprefix("Visual inertial affordances: ")

    write_section(folder / "my_weight", section)
    assert find() == "My experiment"
    write_section(folder / "my_com", section._replace(title="Another"))
    assert find() == "results"
    write_section(folder / "com", section)
    assert find() == "the paper and what we find"


def test_report_without_claims_counts_none(folder):
    write_section(folder / "weight", make_section(1, "My experiment")._replace(figures=[], claims=[]))
    assert "claims are met" not in write_page(folder)


def test_findings_begin_with_a_capital_and_percent_signs_follow_a_space(folder):
    section = make_section(1, "Simulation I")._replace(finding="own memory: right in 51% of cases.")
    write_section(folder / "weight", section)
    page = write_page(folder)
    assert "Own memory: right in 51\u00a0% of cases." in page
    assert "max-width: 100%" in page  # a length of the style sheet
