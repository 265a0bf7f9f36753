"""The mutation run: places are found again, and the page agrees with the sample."""

from pathlib import Path

from studies.mutants.command import FOLDERS
from studies.mutants.run import describe, get_folder, mutate, read_sample

ROOT = Path(__file__).parents[3]
SAMPLE = read_sample()[1]


def test_lines_are_replaced_where_they_stand_nearest_to_where_they_stood():
    text = "a = 1\nb = 2\nif a:\n    a = 1\na = 1\n"
    mutant = {"before": "a = 1\n", "after": "a = 2\n", "line": 1}
    assert mutate(text, mutant) == "a = 2\nb = 2\nif a:\n    a = 1\na = 1\n"
    assert mutate(text, {**mutant, "line": 4}) == "a = 1\nb = 2\nif a:\n    a = 1\na = 2\n"
    assert mutate(text, {**mutant, "before": "c = 1\n"}) is None


def test_sample_is_large_and_of_the_folders_that_are_said():
    assert len(SAMPLE) >= 200
    assert {get_folder(mutant) for mutant in SAMPLE} == set(FOLDERS)


def test_page_says_what_the_sample_says():
    page = (ROOT / "docs" / "mutants.md").read_text(encoding="utf-8")
    assert describe(SAMPLE) in page
    survivors = [mutant for mutant in SAMPLE if mutant["now"] == "survived"]
    assert all(mutant.get("why") for mutant in survivors)
    assert len(survivors) < 0.1 * len(SAMPLE)


def test_errors_made_on_purpose_name_tests_that_there_are():
    page = (ROOT / "docs" / "mutants.md").read_text(encoding="utf-8")
    named = [line.split("`")[1] for line in page.split("## Errors made on purpose")[1].splitlines() if "::" in line]
    assert len(named) == 13
    for name in named:
        path, test = name.split("::")
        assert f"def {test}(" in (ROOT / "tests" / path).read_text(encoding="utf-8")
