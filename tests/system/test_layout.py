"""Layout of the library: number of loose modules, and length of the longest chain of imports (decision 0029)."""

import ast
import tomllib
from collections.abc import Mapping, Set
from functools import cache
from pathlib import Path

import affordance

LIBRARY = Path(affordance.__file__).parent
MOST_LOOSE = 8
LONGEST_CHAIN = 12


def find_longest_chain(imports: Mapping[str, Set[str]]) -> list[str]:
    """Finds the longest chain in which each module imports the next; no circles exist."""

    @cache
    def follow(module: str) -> tuple[str, ...]:
        return (module, *max((follow(other) for other in sorted(imports[module])), key=len, default=()))

    return list(max((follow(module) for module in sorted(imports)), key=len))


def read_imports(library: Path) -> dict[str, set[str]]:
    """Reads which modules of a library each of its modules imports, inside functions too."""
    root = library.parent
    paths = {
        ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path
        for path in library.rglob("*.py")
    }
    imports: dict[str, set[str]] = {}
    for module, path in paths.items():
        named = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                named |= {f"{node.module}.{each.name}" for each in node.names}
                named |= {node.module for each in node.names if f"{node.module}.{each.name}" not in paths}
            elif isinstance(node, ast.Import):
                named |= {each.name for each in node.names}
        imports[module] = (named & set(paths)) - {module}
    return imports


def test_few_modules_lie_loose_in_the_library():
    loose = {path.name for path in LIBRARY.glob("*.py")} - {"__init__.py", "__main__.py"}
    assert len(loose) <= MOST_LOOSE, sorted(loose)


def test_longest_chain_of_imports_is_short():
    chain = find_longest_chain(read_imports(LIBRARY))
    assert len(chain) <= LONGEST_CHAIN, " > ".join(chain)


def test_a_chain_is_found_through_functions_and_packages(tmp_path):
    library = tmp_path / "library"
    (library / "inner").mkdir(parents=True)
    for name, text in {
        "__init__": "",
        "inner/__init__": "x = 1\n",
        "top": "def run():\n    from library.inner import middle\n",
        "inner/middle": "import library.low\n",
        "low": "from library.inner import x\n",
    }.items():
        (library / f"{name}.py").write_text(text)
    chain = find_longest_chain(read_imports(library))
    assert chain == ["library.top", "library.inner.middle", "library.low", "library.inner"]


def test_every_folder_of_the_library_is_packaged():
    listed = tomllib.loads((LIBRARY.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"][
        "packages"
    ]
    files = [path for path in LIBRARY.rglob("*.*") if path.is_file() and "__pycache__" not in path.parts]
    folders = {".".join(path.parent.relative_to(LIBRARY.parent).parts) for path in files}
    assert sorted(folders - set(listed)) == []
