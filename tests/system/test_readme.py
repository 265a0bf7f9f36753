"""Examples, commands, links and targets of the README and of the pages of first use work as they are shown."""

import re
import shlex
from pathlib import Path

import pytest

from affordance.cli import main
from affordance.commands.catalogue import COMMANDS, load_command
from affordance.commands.demo import TRIALS
from affordance.commands.parser import OneLineParser
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import run_suite
from affordance.files.model_folder import import_study

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS_PAGE = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
HOW_TO = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "howto").glob("*.md")))
# Pages of pictures, where a folder of the reader's is in capitals.
GALLERY = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("gallery*.md")))
# Commands that are run, with options that make them cheap; the others are only parsed: they take a robot's file or a
# recording of the reader's, or long (run, watch, study, excite), and have tests of their own.
RUN = {
    "affordance doctor": "",
    "affordance identify --demo": "--samples 500",
    "affordance rank --demo": "--samples 200 --only mallet",
    "affordance rank hammer": "--samples 200",
    "affordance next hammer reach": "--samples 100 --only mallet",
    "affordance memory show workshop.sqlite": "",
    "affordance tutorials": "--copy-only",
}
OBJECTS_PAGE = (ROOT / "docs" / "objects.md").read_text(encoding="utf-8")


def find_blocks(language, page=README):
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


def list_commands():
    """Commands in a line of their own or between backticks; alternatives and remarks are left out."""
    lines = re.findall(r"^ {4,}(affordance [^#\n]*)", README + COMMANDS_PAGE + HOW_TO, re.MULTILINE)
    lines += re.findall(r"`(affordance [^`]*)`", README + COMMANDS_PAGE)
    shown = [*find_blocks("bash", GALLERY), *re.findall(r'"(affordance [^"]*)"', GALLERY)]
    commands = [line for block in shown for line in re.split(r"\n| && ", block.replace("\\\n", " "))]
    lines += [line for line in commands if line.startswith("affordance")]
    return sorted({line.strip() for line in lines if not re.search(r"\[|\||\.\.\.|COMMAND|NAME", line)})


def run_block(block, capsys):
    exec(block, {})
    return capsys.readouterr().out


def test_first_example_prints_what_stands_below_it(capsys):
    (code,) = find_blocks("python")
    assert code.count("\n") <= 12
    assert run_block(code, capsys) == find_blocks("text")[0]


def test_example_of_ranking_runs(capsys):
    lines = run_block(find_blocks("python", OBJECTS_PAGE)[0], capsys).splitlines()
    assert len(lines) == 4
    assert re.fullmatch(r"stick by steel: \d+\.\d J, best with probability 0\.90", lines[0])


@pytest.mark.usefixtures("unrendered")
def test_own_objects_make_an_experiment(tmp_path, models):
    (models / "tools" / "weight.yaml").write_text(find_blocks("yaml", OBJECTS_PAGE)[0], encoding="utf-8")
    report, *_ = run_suite("weight", Setup(observers=1, models=models, out=tmp_path / "results"))
    assert "dumb-bell" in report.read_text(encoding="utf-8")
    assert (tmp_path / "results" / "weight" / "metrics.json").exists()


@pytest.mark.parametrize("line", list_commands())
def test_commands_are_such_as_the_program_takes(line):
    _, name, *words = shlex.split(line)
    parser = OneLineParser(prog=name)
    if name == "study":
        import_study(words.pop(0)).add_arguments(parser)
    else:
        assert name in COMMANDS
        load_command(name).add_arguments(parser)
    parser.parse(words)


def test_kept_pictures_are_in_the_gallery():
    pictures = {path.name for path in (ROOT / "docs" / "images").iterdir()}
    assert pictures == set(re.findall(r"\bimages/([\w.]+)", GALLERY))


def test_commands_that_are_cheap_run_as_shown(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert set(RUN) <= set(list_commands())
    assert main(["memory", "import", "workshop.sqlite", str(TRIALS)]) == 0
    for line, cheaper in RUN.items():
        capsys.readouterr()
        assert main(shlex.split(f"{line} {cheaper}")[1:]) == 0, line
        said = capsys.readouterr()
        assert said.out, line
        assert "Traceback" not in said.err, line


def list_pages():
    pages = [page for way in ("*.md", "docs/**/*.md", "affordance/tutorials/*.md") for page in ROOT.glob(way)]
    return [*pages, ROOT / "models" / "README.md"]


def test_targets_of_make_exist():
    targets = re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for page in list_pages():
        named = re.findall(r"(?:^    |`)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
        assert set(named) <= set(targets), page


def test_readme_is_read_in_some_minutes():
    assert README.count("\n") <= 90


def list_anchors(page):
    """Headings as links name them: in small letters, spaces as hyphens, without punctuation."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_linked_files_and_headings_exist():
    for page in list_pages():
        for target, heading in re.findall(r"\]\(([^)#:]*)#?([^):]*)\)", page.read_text(encoding="utf-8")):
            linked = page.parent / target if target else page
            assert linked.exists(), f"{page}: {target}"
            if heading:
                assert heading in list_anchors(linked), f"{page}: {target}#{heading}"
