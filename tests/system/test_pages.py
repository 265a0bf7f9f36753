"""Numbers of the pages are those of the results that are kept with them; names that pages import exist."""

import importlib.util
import re

import pytest
from helpers.imports import can_import

from affordance import __version__
from affordance.files.model_folder import MODELS

_SPEC = importlib.util.spec_from_file_location("fill_numbers", MODELS.parent / "docs" / "fill_numbers.py")
fill_numbers = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(fill_numbers)
# Folders of results that the version in hand was not run for.
OF_AN_EARLIER_VERSION = {"live"}  # 55 minutes of processor time


def test_numbers_of_the_pages_are_those_of_the_results():
    kept, marks = fill_numbers.read_kept(), list(fill_numbers.list_marks())
    assert marks
    for mark in marks:
        assert mark.text == mark.show(kept[mark.folder]["values"][mark.place]), mark
    named = {(mark.folder, mark.place) for mark in marks}
    assert named == {(folder, place) for folder in kept for place in kept[folder]["values"]}


def test_no_number_begins_a_line():
    """A line that begins with a comment ends the paragraph before it."""
    for page in fill_numbers.list_pages():
        assert re.findall(r"^\s*<!--=.*", page.read_text(encoding="utf-8"), re.MULTILINE) == [], page


def test_names_that_pages_import_exist():
    root = MODELS.parent
    pages = [*root.glob("*.md"), *root.glob("docs/**/*.md")]
    imports = [
        (page, module, name)
        for page in pages
        for module, names in re.findall(r"^from (affordance[\w.]*) import ([\w, ]+)$", page.read_text(), re.MULTILINE)
        for name in names.split(", ")
    ]
    assert imports
    for page, module, name in imports:
        assert can_import(module, name), f"{page}: {module}.{name}"


def test_results_of_another_number_of_observers_are_refused(tmp_path):
    kept = fill_numbers.read_kept()
    path = tmp_path / "weight" / "metrics.json"
    path.parent.mkdir()
    path.write_text('{"repeats": 3}', encoding="utf-8")
    with pytest.raises(SystemExit, match="is of 3 repeats, the pages are of 200"):
        fill_numbers.collect(tmp_path, kept)


def test_results_are_of_this_version_but_for_those_that_say_so():
    """A page that shows numbers of an earlier version shows that version among them."""
    kept = fill_numbers.read_kept()
    versions = {folder: entry["run"].get("affordance") for folder, entry in kept.items()}
    earlier = {folder for folder, version in versions.items() if version != __version__}
    assert earlier == OF_AN_EARLIER_VERSION, f"{versions}: make numbers, then name in this test what is left"
    pages = {(mark.folder, mark.page) for mark in fill_numbers.list_marks() if mark.folder in earlier}
    for folder, page in pages:
        marks = {mark.place: mark.text for mark in fill_numbers.list_marks() if mark[:2] == (page, folder)}
        assert marks.get('versions["affordance"]') == versions[folder], (
            f"{page} does not say which version {folder} is of"
        )


@pytest.mark.parametrize(
    ("text", "value", "shown"),
    [(".2f", 0.643, "0.64"), (".0f%", 0.643, "64"), ("", "steel", "steel"), (".1f", None, "-")],
)
def test_values_are_shown_in_the_format_of_the_page(text, value, shown):
    assert fill_numbers.Mark("page", "folder", "x", text, "").show(value) == shown
