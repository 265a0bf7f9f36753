"""The report in a real browser: a narrow screen never scrolls sideways, and a tap enlarges a picture."""

from helpers.browser import open_page
from matplotlib.figure import Figure

from affordance.reporting.claims import ClaimResult, CriterionResult
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import ReportFigure, Section, Table

WIDTH = "() => document.documentElement.scrollWidth"
PICTURE = "() => document.querySelector('figure img').getBoundingClientRect().width"


def test_narrow_page_never_scrolls_sideways_and_a_tap_enlarges_a_picture(tmp_path):
    folder = tmp_path / "weight"
    folder.mkdir()
    save_figure(Figure(figsize=(12.0, 3.0)), folder, "figure")
    criterion = CriterionResult("drop over the one before", ", ".join(["0.0412"] * 30), "at most 1", False)
    section = Section(
        order=1,
        title="Simulation I",
        summary="Objects are held.",
        figures=[ReportFigure(file="figure.png", caption="Figure 3")],
        claims=[ClaimResult("drop", "paper IV-A", "The drop is reduced.", False, (criterion,))],
        tables=[Table("Trial by trial.", [f"quantity {k}" for k in range(12)], [["7.79 J (wood)"] * 12])],
        remarks=["No constants are given."],
    )
    write_section(folder, section)
    path = write_report(tmp_path)
    with open_page(420, 900) as page:
        page.goto(path.as_uri())
        page.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true })")
        assert page.evaluate(WIDTH) == 420
        assert page.evaluate(PICTURE) < 420
        page.locator("figure img").first.click()
        assert page.evaluate(PICTURE) > 800
        assert page.evaluate(WIDTH) == 420
        page.locator("figure img").first.click()
        assert page.evaluate(PICTURE) < 420
