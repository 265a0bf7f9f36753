"""Breaks the program in randomly drawn places and sees whether the tests notice.

The sample lies in sample.json; draw.py draws another. Each mutant is tried in a copy of the tree, against
those test files of its folder that execute its line, that of its module first. Every run is a fork of this process,
which has the libraries loaded. Outcomes, and the page docs/mutants.md, are written folder by folder.
"""

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from studies.mutants.command import FOLDERS
from studies.study import format_table

ROOT = Path(__file__).parents[2]
SAMPLE, PAGE = Path(__file__).with_name("sample.json"), ROOT / "docs" / "mutants.md"
NOT_COPIED = shutil.ignore_patterns(".*", "results", "build", "__pycache__", "*.egg-info")
START, END = "<!-- make mutants writes from here -->", "<!-- to here -->"
# Generous: a mutant that is only slow on a loaded machine shall not count as noticed. [s]
LIMIT, LIMIT_FACTOR = 60.0, 10.0
Mutant = dict[str, Any]


class SuiteFile(NamedTuple):
    """A file of tests: which lines of the program it executes, by module, and how long it takes, [s]."""

    path: str
    lines: dict[str, list[int]]
    duration: float


def get_folder(mutant: Mutant) -> str:
    """Names the folder of a mutant's module and of its tests, with the folders inside it."""
    module = mutant["module"].removeprefix("affordance/")
    return next(folder for folder in FOLDERS if module.startswith(f"{folder}/"))


def mutate(text: str, mutant: Mutant) -> str | None:
    """Replaces the mutant's lines by the mutated ones, where they stand nearest to the line on which they stood."""
    starts = [
        i for i in range(len(text)) if text.startswith(mutant["before"], i) and text[:i].endswith(("", "\n")[i > 0])
    ]
    if not starts:
        return None
    start = min(starts, key=lambda i: abs(text[:i].count("\n") + 1 - mutant["line"]))
    return f"{text[:start]}{mutant['after']}{text[start + len(mutant['before']) :]}"


def _run(tree: Path, tests: Sequence[str], limit: float, lines: Path | None = None) -> str | None:
    """Runs tests in a fork until one fails, and names it; None where all pass. Lines executed can be written down."""
    log = tree / "log.txt"
    child = os.fork()
    if not child:
        _become_tests(tree, tests, log, lines)
    end = time.monotonic() + limit
    while (done := os.waitpid(child, os.WNOHANG)) == (0, 0):
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return f"no end within {limit:.0f} s"
        time.sleep(0.02)
    if done[1] == 0:
        return None
    said = [
        line.split(" - ")[0]
        for line in log.read_text(encoding="utf-8").splitlines()
        if line.startswith(("FAILED", "ERROR"))
    ]
    return said[0].split(" ", 1)[1].strip() if said else "no test could be run"


def _become_tests(tree: Path, tests: Sequence[str], log: Path, lines: Path | None) -> None:
    os.setsid()
    os.chdir(tree)
    os.environ["PYTHONPATH"] = str(tree)
    sys.path.insert(0, str(tree))
    with log.open("w", encoding="utf-8") as written:
        os.dup2(written.fileno(), 1)
        os.dup2(written.fileno(), 2)
    for name in [name for name in sys.modules if name.split(".")[0] in ("affordance", "studies")]:
        del sys.modules[name]
    executed: dict[str, list[int]] = {}
    if lines is not None:
        _note_lines(tree, executed)
    status = pytest.main([*tests, "-x", "-q", "-n", "0", "-p", "no:cacheprovider"])
    if lines is not None:
        lines.write_text(json.dumps(executed), encoding="utf-8")
    sys.stdout.flush()
    os._exit(int(status))


def _note_lines(tree: Path, executed: dict[str, list[int]]) -> None:
    """Notes each line of the program that this process executes, once."""
    start = f"{tree}/"

    def note(code: Any, line: int) -> Any:
        if code.co_filename.startswith((start + "affordance/", start + "studies/")):
            executed.setdefault(code.co_filename.removeprefix(start), []).append(line)
        return sys.monitoring.DISABLE

    tool = sys.monitoring.COVERAGE_ID
    sys.monitoring.use_tool_id(tool, "mutants")
    sys.monitoring.register_callback(tool, sys.monitoring.events.LINE, note)
    sys.monitoring.set_events(tool, sys.monitoring.events.LINE)


def measure_tests(tree: Path, folder: str) -> list[SuiteFile]:
    """Runs each file of a folder's tests as it is, the quickest first in what is returned."""
    found, lines = [], tree / "lines.json"
    for path in sorted((tree / "tests" / folder).rglob("test_*.py")):
        name, started = path.relative_to(tree).as_posix(), time.monotonic()
        failed = _run(tree, [name], 3600.0, lines)
        if failed:
            raise SystemExit(f"mutants: {failed} fails as it is")
        found.append(SuiteFile(name, json.loads(lines.read_text(encoding="utf-8")), time.monotonic() - started))
    return sorted(found, key=lambda file: file.duration)


def choose_tests(files: Collection[SuiteFile], mutant: Mutant, text: str) -> list[SuiteFile]:
    """The files that execute a mutant's lines, that of its module first; all of them where none does."""
    first = (
        text[: text.index(mutant["before"])].count("\n") + 1 if text.count(mutant["before"]) == 1 else mutant["line"]
    )
    lines = set(range(first, first + mutant["before"].count("\n")))
    chosen = [file for file in files if lines & set(file.lines.get(mutant["module"], []))] or list(files)
    return sorted(chosen, key=lambda file: not file.path.endswith(f"/test_{Path(mutant['module']).name}"))


def attempt(mutant: Mutant, tree: Path, files: Collection[SuiteFile]) -> str:
    """Tries one mutant, writes its outcome into it, and says which test noticed."""
    path = tree / mutant["module"]
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    mutated = mutate(text, mutant)
    if mutated is None:
        mutant["now"] = "gone"
        return ""
    times = path.stat()
    chosen = choose_tests(files, mutant, text)
    path.write_text(mutated, encoding="utf-8")
    noticed = _run(tree, [file.path for file in chosen], LIMIT + LIMIT_FACTOR * sum(file.duration for file in chosen))
    path.write_text(text, encoding="utf-8")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # as before, so that Python finds what it compiled
    mutant["now"] = "killed" if noticed else "survived"
    return noticed or ""


def read_sample() -> tuple[int, list[Mutant]]:
    """Reads the seed of the sample, and its mutants."""
    content = json.loads(SAMPLE.read_text(encoding="utf-8"))
    return content["seed"], content["mutants"]


def write_sample(seed: int, mutants: Sequence[Mutant]) -> None:
    """Writes a sample and its outcomes, a mutant a line."""
    lines = ",\n".join(json.dumps(mutant) for mutant in mutants)
    SAMPLE.write_text(f'{{"seed": {seed}, "mutants": [\n{lines}\n]}}\n', encoding="utf-8")


def describe(mutants: Sequence[Mutant]) -> str:
    """Lays out the score by folder, and the survivors with the reason why."""
    rows = []
    for folder in (*FOLDERS, "all"):
        here = [
            mutant
            for mutant in mutants
            if folder in ("all", get_folder(mutant)) and mutant.get("now") in ("killed", "survived")
        ]
        counts = [sum(mutant.get(when) == "killed" for mutant in here) for when in ("first", "now")]
        rows.append([folder, str(len(here)), *(f"{count} ({count / max(len(here), 1):.0%})" for count in counts)])
    survivors = [mutant for mutant in mutants if mutant.get("now") == "survived"]
    lines = [
        [
            f"`{m['module'].removeprefix('affordance/')}`",
            *(_show(m[key]) for key in ("before", "after")),
            m.get("why", ""),
        ]
        for m in survivors
    ]
    score = format_table(["folder", "mutants", "noticed before", "noticed now"], rows)
    rest = format_table(["module", "as it is", "mutant", "why it stays"], lines)
    return f"{score}\n\nThe {len(survivors)} that nothing notices:\n\n{rest}"


def _show(lines: str) -> str:
    return f"`{' '.join(lines.split())}`".replace("|", "\\|")


def try_sample(folders: Sequence[str], *, only_survivors: bool) -> int:
    """Tries the mutants of folders, all or those that survived when last tried; returns exit status 0."""
    os.nice(5)
    seed, mutants = read_sample()
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(shutil.copytree(ROOT, Path(scratch, "tree"), ignore=NOT_COPIED)).resolve()
        for folder in folders:
            files = measure_tests(tree, folder)
            for mutant in mutants:
                if get_folder(mutant) == folder and (not only_survivors or mutant.get("now") == "survived"):
                    noticed = attempt(mutant, tree, files)
                    mutant.setdefault("first", mutant["now"])
                    where = f"{mutant['module']}:{mutant['line']}"
                    print(f"{mutant['now']:8} {where} {mutant['operator']} {noticed}", flush=True)
            write_sample(seed, mutants)
            head, rest = PAGE.read_text(encoding="utf-8").split(START)
            PAGE.write_text(f"{head}{START}\n\n{describe(mutants)}\n\n{END}{rest.split(END)[1]}", encoding="utf-8")
    return 0
