"""Imports all of the library but one extension and what rests on it, for each extension in turn, in one process."""

import importlib
import pkgutil
import sys
from collections.abc import Mapping
from pathlib import Path

import affordance

LIBRARY = Path(affordance.__file__).parent
EXTENSIONS = sorted(path.parent.name for path in (LIBRARY / "extensions").glob("*/__init__.py"))


def list_users() -> Mapping[str, set[str]]:
    """Lists the extensions that cannot do without an extension, itself included, by its name."""
    users = {name: {name} for name in EXTENSIONS}
    for other in EXTENSIONS:
        texts = [path.read_text(encoding="utf-8") for path in (LIBRARY / "extensions" / other).rglob("*.py")]
        for name in EXTENSIONS:
            if any(f"affordance.extensions.{name}" in text for text in texts):
                users[name].add(other)
    return users


class Refusal:
    """Finder that finds no module below the named folders, as if they were deleted."""

    def __init__(self, names: set[str]) -> None:
        self._folders = [f"affordance.{place}.{name}" for place in ("extensions", "commands") for name in names]

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if any(name == each or name.startswith(f"{each}.") for each in self._folders):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    def refuses(self, name: str) -> bool:
        return any(name == each or name.startswith(f"{each}.") for each in self._folders)


def import_without(names: set[str]) -> int:
    """Imports all modules but those of the named extensions and their commands; returns the number of modules."""
    refusal, count = Refusal(names), 0
    for name in [name for name in sys.modules if name.partition(".")[0] == "affordance"]:
        del sys.modules[name]
    sys.meta_path.insert(0, refusal)
    try:
        package = importlib.import_module("affordance")
        for path in sorted(LIBRARY.rglob("__init__.py")):
            folder = ".".join(path.parent.relative_to(LIBRARY.parent).parts)
            for info in pkgutil.iter_modules([str(path.parent)], f"{folder}."):
                if not refusal.refuses(info.name) and not info.name.endswith(".__main__"):
                    importlib.import_module(info.name)
                    count += 1
        assert package.TrialRunner
    finally:
        sys.meta_path.remove(refusal)
    return count


if __name__ == "__main__":
    for names in [*list_users().values(), set(EXTENSIONS)]:
        print(f"{import_without(names)} modules without {', '.join(sorted(names))}", flush=True)
