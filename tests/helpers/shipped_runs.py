"""Small runs of the shipped experiments, and the numbers that the suite keeps of them.

``python -m helpers.shipped_runs`` in this folder's parent remakes the kept numbers (``make kept-numbers``).
"""

import json
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pytest

from affordance.choice import off_axis
from affordance.commands.catalogue import EXPERIMENTS, find_experiment
from affordance.experiments import hammer, reach
from affordance.experiments.shared import observers
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import write_results
from affordance.files.atomic import to_plain
from affordance.files.model_folder import MODELS
from affordance.reporting.claims import ClaimResult

OBSERVERS = 2
NAMES = EXPERIMENTS
KEPT = Path(__file__).parents[1] / "experiments" / "kept"
# What a clock says.
_NOT_KEPT = "ms_per_object"


class Run(NamedTuple):
    """Results of a run without its figures, for comparison with kept ones.

    Attributes:
        entered: Files whose code ran, either for an observer or to plan for observers.
    """

    folder: Path
    setup: Setup
    data: Any
    numbers: Mapping[str, Any]
    claims: Sequence[ClaimResult]
    summary: str
    finding: str
    captions: Mapping[str, str]
    tables: Mapping[str, pd.DataFrame]
    remarks: Sequence[str]
    lifts: pd.DataFrame | None
    entered: frozenset[str]


def run_shipped(name: str, out: Path) -> Run:
    """Runs a shipped experiment with two observers, and writes its results.

    Simulations III and IV are about the first two of their tools, whose parts are moved in two ways only for the
    number that says what moving them changes.
    """
    models = MODELS if name not in ("reach", "hammer") else make_models(out / f"models_{name}", num_novel=2)
    setup, start = Setup(observers=OBSERVERS, out=out, models=models), time.perf_counter()
    with save_time(), note_entered() as entered:
        results = find_experiment(name).run(setup)
    write_results(results, name, setup, start)
    return Run(
        folder=out / name,
        setup=setup,
        data=results.data,
        numbers=results.numbers,
        claims=results.claims,
        summary=results.summary,
        finding=results.finding,
        captions={file: caption for file, (caption, _) in results.figures.items()},
        tables=results.tables,
        remarks=results.remarks,
        lifts=results.lifts,
        entered=frozenset(entered),
    )


def make_models(folder: Path, *, num_novel: int) -> Path:
    """Copies the models, with the first few of the novel tools."""
    shutil.copytree(MODELS, folder)
    path = folder / "tools" / "novel.yaml"
    head, *tools = path.read_text(encoding="utf-8").split("  - name: ")
    path.write_text("  - name: ".join([head, *tools[:num_novel]]), encoding="utf-8")
    return folder


@contextmanager
def save_time() -> Iterator[None]:
    """Moves the parts of each tool in two ways only (all: ``test_off_axis.py``)."""
    every = off_axis.list_shifted
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(off_axis, "list_shifted", lambda tool: [*every(tool)][:2])
        yield


@contextmanager
def note_entered() -> Iterator[set[str]]:
    """Notes the files whose code is run by observers, and by what plans a task for them."""
    monitoring, entered = sys.monitoring, set[str]()
    tool, event = monitoring.PROFILER_ID, monitoring.events.PY_START

    def note(code: Any, offset: int) -> Any:
        entered.add(code.co_filename)
        return monitoring.DISABLE

    def noting(function: Any) -> Any:
        def noted(*arguments: Any, **words: Any) -> Any:
            monitoring.use_tool_id(tool, "entered")
            monitoring.register_callback(tool, event, note)
            monitoring.restart_events()
            monitoring.set_events(tool, event)
            try:
                return function(*arguments, **words)
            finally:
                monitoring.set_events(tool, 0)
                monitoring.free_tool_id(tool)

        return noted

    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((observers, "_observe"), (reach, "plan"), (hammer, "plan_blows")):
            patch.setattr(module, name, noting(getattr(module, name)))
        yield entered


def list_kept(found: Run) -> dict[str, Any]:
    """Lists the numbers of a run that are kept, and which claims are met."""
    numbers = {name: value for name, value in found.numbers.items() if name != _NOT_KEPT}
    claims = {claim.key: claim.met for claim in found.claims}
    plain: dict[str, Any] = json.loads(json.dumps(to_plain({"numbers": numbers, "claims": claims})))
    return plain


def remake() -> None:
    """Remakes the files of kept numbers, and says which changed."""
    KEPT.mkdir(exist_ok=True)
    for name in NAMES:
        path = KEPT / f"{name}.json"
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        with tempfile.TemporaryDirectory() as folder:
            text = json.dumps(list_kept(run_shipped(name, Path(folder))), indent=1) + "\n"
        path.write_text(text, encoding="utf-8")
        print(f"{path.name}: {'as before' if text == before else 'changed'}", flush=True)


if __name__ == "__main__":
    remake()
