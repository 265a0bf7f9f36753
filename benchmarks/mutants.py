"""Breaks the program in randomly drawn places and sees whether the tests notice: ``make mutants``.

The sample lies in mutants.json. ``--draw`` draws another one with cosmic-ray's operators (extra ``mutation``): first
a place, then one of the replacements there. Each mutant is tried against the tests of its folder, those of its module
first, in a copy of the tree. Outcomes and the page docs/mutants.md are written when all are tried.
"""

import argparse
import difflib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from random import Random
from typing import Any

from affordance.files.atomic import write_text
from benchmarks.tables import format_table

SAMPLE, PAGE = Path("benchmarks/mutants.json"), Path("docs/mutants.md")
FOLDERS = ("belief", "proprioception", "plant", "control", "choice", "identification", "experiments/robustness")
# Replacements by these raise TypeError with any float, or are the same as others: cheap mutants, which say nothing.
SILLY = frozenset({"RShift", "LShift", "Mod", "FloorDiv", "Is", "IsNot", "Invert", "UAdd", "USub_Not"})
# Operators here are no arithmetic: types, stars.
NO_ARITHMETIC = ("annassign", "tfpdef", "param", "parameters", "dictorsetmaker", "funcdef")
NOT_COPIED = shutil.ignore_patterns(".*", "results", "build", "__pycache__", "*.egg-info")
START, END = "<!-- make mutants writes from here", "<!-- to here -->"
Mutant = dict[str, Any]


def _find_replacements(text: str) -> Iterator[tuple[tuple[int, int], str, int]]:
    """Lists place, operator and occurrence of everything worth replacing that cosmic-ray can replace in a module."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.operators.provider import _OPERATORS

    nodes = list(ast_nodes(get_ast(text)))
    for name, operator in _OPERATORS.items():
        if not operator.arguments() and _is_worth_it(name):
            found = [(node, place) for node in nodes for place, _ in operator().mutation_positions(node)]
            for occurrence, (node, place) in enumerate(found):
                if "Binary" not in name or _is_arithmetic(node):
                    yield place, name, occurrence


def _is_worth_it(operator: str) -> bool:
    if "_" not in operator:
        return True
    _, *old, new = operator.split("_")
    if {*old, new} == {"Is", "IsNot"}:
        return True
    if (new.startswith("Bit")) != ("".join(old).startswith("Bit")):
        return False
    return not {new, "_".join([*old, new])} & SILLY


def _is_arithmetic(node: Any) -> bool:
    while (node := node.parent) is not None and node.type not in ("simple_stmt", "suite"):
        if node.type in NO_ARITHMETIC:
            return False
    return True


def draw(number: int, seed: int) -> list[Mutant]:
    """Draws places without replacement, each as probable, and a replacement for each."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.operators.provider import _OPERATORS

    places = defaultdict(list)
    texts = {
        path.as_posix(): path.read_text() for folder in FOLDERS for path in Path("affordance", folder).glob("*.py")
    }
    for module, text in sorted(texts.items()):
        for place, name, occurrence in _find_replacements(text):
            places[module, place].append((name, occurrence))
    random, sample = Random(seed), []
    for module, place in random.sample(sorted(places), len(places)):
        name, occurrence = random.choice(places[module, place])
        old = texts[module].splitlines(keepends=True)
        changed = mutate_code(texts[module], _OPERATORS[name](), occurrence)
        new = changed.splitlines(keepends=True)
        blocks = difflib.SequenceMatcher(a=old, b=new, autojunk=False).get_opcodes()
        (_, start, end, begin, stop), *others = [block for block in blocks if block[0] != "equal"] or [
            ("", 0, 0, 0, 0)
        ]
        if others or not _compiles(changed):
            continue
        before, after = "".join(old[start:end]), "".join(new[begin:stop])
        where = {"module": module, "line": start + 1, "operator": name, "occurrence": occurrence}
        sample.append({**where, "before": before, "after": after})
        if len(sample) == number:
            break
    return sorted(sample, key=lambda mutant: (mutant["module"], mutant["line"]))


def _compiles(text: str) -> bool:
    try:
        compile(text, "mutant", "exec")
    except SyntaxError:
        return False
    return True


def mutate(text: str, mutant: Mutant) -> str | None:
    """Replaces the mutant's lines by the mutated ones, where they stand nearest to the line on which they stood."""
    starts = [
        i for i in range(len(text)) if text.startswith(mutant["before"], i) and text[:i].endswith(("", "\n")[i > 0])
    ]
    if not starts:
        return None
    start = min(starts, key=lambda i: abs(text[:i].count("\n") + 1 - mutant["line"]))
    return text[:start] + mutant["after"] + text[start + len(mutant["before"]) :]


def _list_tests(module: str, folder: str) -> list[str]:
    """Lists the folder's test files, that of the module first."""
    own = Path("tests", folder, f"test_{Path(module).name}")
    others = sorted(path for path in Path("tests", folder).glob("test_*.py") if path != own)
    return [path.as_posix() for path in ([own] if own.exists() else []) + others]


def _run_tests(tree: Path, tests: Sequence[str], limit: float) -> str | None:
    """Runs tests until one fails, and names it; None where all pass."""
    command = [sys.executable, "-m", "pytest", *tests, "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--no-header"]
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(
            command, cwd=tree, env=environment, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            if process.wait(limit) == 0:
                return None
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return f"no end within {limit:.0f} s"
        log.seek(0)
        lines = [line.split(" - ")[0] for line in log if line.startswith(("FAILED", "ERROR"))]
    return lines[0].split(" ", 1)[1].strip() if lines else "pytest itself"


def _try(mutant: Mutant, tree: Path, limit: float) -> None:
    """Tries one mutant in a tree of its own, and writes down whether it was noticed."""
    path = tree / mutant["module"]
    kept, times = path.read_text(), path.stat()
    mutated = mutate(kept, mutant)
    noticed = ""
    if mutated is None:
        mutant["now"] = "gone"
    else:
        path.write_text(mutated)
        noticed = _run_tests(tree, _list_tests(mutant["module"], get_folder(mutant)), limit) or ""
        mutant["now"] = "killed" if noticed else "survived"
        path.write_text(kept)
        # As before, so that Python finds what it compiled.
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    print(f"{mutant['now']:8} {mutant['module']}:{mutant['line']} {mutant['operator']} {noticed}", flush=True)


def get_folder(mutant: Mutant) -> str:
    """Names the folder of a mutant's module, and of its tests."""
    return Path(mutant["module"]).parent.relative_to("affordance").as_posix()


def try_all(mutants: Sequence[Mutant], jobs: int) -> None:
    """Tries mutants in copies of the tree; of each folder first whether its tests pass, and how long they take."""
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(jobs) as pool:
        trees: Queue[Path] = Queue()
        for i in range(jobs):
            trees.put(shutil.copytree(".", Path(scratch, str(i)), ignore=NOT_COPIED))
        for folder in [name for name in FOLDERS if any(get_folder(mutant) == name for mutant in mutants)]:
            started = time.monotonic()
            noticed = _run_tests(Path(scratch, "0"), _list_tests("", folder), 3600.0)
            if noticed:
                raise SystemExit(f"mutants: tests/{folder} fails as it is: {noticed}")
            # Generous: a mutant that is only slow on a loaded machine shall not count as noticed.
            limit = 60.0 + 5.0 * (time.monotonic() - started)

            def attempt(mutant: Mutant, limit: float = limit) -> None:
                tree = trees.get()
                _try(mutant, tree, limit)
                trees.put(tree)

            list(pool.map(attempt, [mutant for mutant in mutants if get_folder(mutant) == folder]))


def write_sample(sample: dict[str, Any]) -> None:
    """Writes a sample and its outcomes, a mutant a line."""
    lines = ",\n".join(json.dumps(mutant) for mutant in sample["mutants"])
    write_text(SAMPLE, f'{{"seed": {sample["seed"]}, "mutants": [\n{lines}\n]}}\n')


def describe(mutants: Sequence[Mutant]) -> str:
    """Lays out the score by folder, and the survivors with the reason why."""
    rows = []
    for folder in (*FOLDERS, "all"):
        here = [mutant for mutant in mutants if folder in ("all", get_folder(mutant)) and mutant.get("now") != "gone"]
        counts = [sum(mutant.get(when) == "killed" for mutant in here) for when in ("first", "now")]
        shares = [f"{count} ({count / len(here):.0%})" for count in counts]
        rows.append([folder, str(len(here)), *shares])
    survivors = [mutant for mutant in mutants if mutant.get("now") == "survived"]
    lines = [
        [f"`{m['module']}:{m['line']}`", f"`{_show(m['before'])}`", f"`{_show(m['after'])}`", m.get("why", "")]
        for m in survivors
    ]
    return (
        format_table(["folder", "mutants", "noticed before", "noticed now"], rows)
        + f"\n\nThe {len(survivors)} that nothing notices:\n\n"
        + format_table(["where", "as it is", "mutant", "why it stays"], lines)
    )


def _show(lines: str) -> str:
    return " ".join(lines.split()).replace("|", "\\|")


def main() -> None:
    """Draws a sample, or tries the one that lies here."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="*", help="only these, such as belief")
    parser.add_argument("--survivors", action="store_true", help="only mutants that survived when last tried")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--draw", type=int, metavar="NUMBER", help="draw a new sample instead")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if arguments.draw:
        write_sample({"seed": arguments.seed, "mutants": draw(arguments.draw, arguments.seed)})
        return
    os.nice(5)
    sample = json.loads(SAMPLE.read_text())
    chosen = [mutant for mutant in sample["mutants"] if get_folder(mutant) in (arguments.folders or FOLDERS)]
    if arguments.survivors:
        chosen = [mutant for mutant in chosen if mutant.get("now") == "survived"]
    try_all(chosen, arguments.jobs)
    for mutant in chosen:
        mutant.setdefault("first", mutant["now"])
    write_sample(sample)
    head, rest = PAGE.read_text().split(START)
    write_text(PAGE, f"{head}{START} -->\n\n{describe(sample['mutants'])}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
