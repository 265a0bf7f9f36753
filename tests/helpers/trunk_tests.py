"""Runs the trunk's tests in a copy of the repository without an extension, for each extension in turn."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from helpers.without_extensions import LIBRARY, list_users

ROOT = LIBRARY.parent
# Tests of extensions, and of what knows all of them.
_OTHERS = tuple(f"tests/{folder}/" for folder in ("extensions", "commands", "studies", "system"))


def list_named(names: set[str]) -> set[str]:
    """Lists the tests and helpers that use one of the extensions, directly or through other helpers."""
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")}
    direct = re.compile(rf"affordance\.(extensions|commands)\.({'|'.join(names)})\b")
    found = {path for path, text in texts.items() if direct.search(text)}
    while True:
        helpers = "|".join(Path(path).stem for path in found if path.startswith("tests/helpers/")) or "-"
        more = {path for path, text in texts.items() if re.search(rf"from helpers\.({helpers}) import", text)}
        if more <= found:
            return found
        found |= more


def run_tests(names: set[str], words: list[str]) -> int:
    """Runs the tests of the trunk that use none of the extensions in a copy without them; returns the exit status."""
    gone = tuple(f"{place}/{name}/" for place in ("affordance/extensions", "affordance/commands") for name in names)
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, text=True, capture_output=True, check=True).stdout
    kept = [file for file in listed.splitlines() if not file.startswith(gone)]
    named = list_named(names)
    tests = [file for file in kept if re.match(r"tests/(?:.*/)?test_\w+\.py", file) and not file.startswith(_OTHERS)]
    with tempfile.TemporaryDirectory() as folder:
        for file in kept:
            path = Path(folder) / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes((ROOT / file).read_bytes())
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *words]
        command += [file for file in tests if file not in named]
        print(f"Without {', '.join(sorted(names))}:", flush=True)
        return subprocess.run(command, cwd=folder, env={**os.environ, "PYTHONPATH": folder}, check=False).returncode


if __name__ == "__main__":
    sys.exit(max(run_tests(names, sys.argv[1:]) for names in list_users().values()))
