"""Layout of the library: number of loose modules, and length of the longest chain of imports (decision 0029)."""

import ast
import tomllib
from functools import cache
from pathlib import Path

import grimp
import pytest

import affordance

LIBRARY = Path(affordance.__file__).parent
MOST_LOOSE = 8
LONGEST_CHAIN = 12


def test_few_modules_lie_loose_in_the_library():
    loose = {path.name for path in LIBRARY.glob("*.py")} - {"__init__.py", "__main__.py"}
    assert len(loose) <= MOST_LOOSE, sorted(loose)


def test_longest_chain_of_imports_is_short():
    """No chain in which each module imports the next is long, imports inside of functions included."""
    graph = grimp.build_graph("affordance", cache_dir=None)

    @cache
    def follow(module: str) -> tuple[str, ...]:
        others = sorted(graph.find_modules_directly_imported_by(module))
        return (module, *max(map(follow, others), key=len, default=()))

    chain = max(map(follow, sorted(graph.modules)), key=len)
    assert 8 < len(chain) <= LONGEST_CHAIN, " > ".join(chain)


def test_every_folder_of_the_library_is_packaged():
    listed = tomllib.loads((LIBRARY.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"][
        "packages"
    ]
    files = [path for path in LIBRARY.rglob("*.*") if path.is_file() and "__pycache__" not in path.parts]
    folders = {".".join(path.parent.relative_to(LIBRARY.parent).parts) for path in files}
    assert sorted(folders - set(listed)) == []


@pytest.mark.parametrize(
    "path", [path for folder in ("affordance", "studies") for path in sorted((LIBRARY.parent / folder).rglob("*.py"))]
)
def test_progress_bars_are_for_terminals_only(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = [
        each for each in ast.walk(tree) if isinstance(each, ast.Call) and ast.unparse(each.func).endswith("tqdm")
    ]
    for call in calls:
        assert "disable=None" in ast.unparse(call), f"line {call.lineno}"
