"""Files of text are read and written as UTF-8, whatever the locale of who runs the program."""

import ast
import os
import subprocess
import sys

import pytest
from helpers.children import ROOT

SOURCES = sorted(path for folder in ("affordance", "studies") for path in (ROOT / folder).rglob("*.py"))
# Number of arguments of methods and of ``open`` if the encoding is given by its place.
CALLS = {"read_text": 1, "write_text": 2, "open": 4}


def list_without_encoding(text):
    """Lines of calls that would read or write text in the encoding of the locale."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        modes = [a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
        binary = any("b" in mode and len(mode) <= 3 for mode in modes)
        if name not in CALLS or binary or any(keyword.arg == "encoding" for keyword in node.keywords):
            continue
        own = name == "write_text" and isinstance(node.func, ast.Name)  # files.atomic writes UTF-8
        # Of a bag, which has its own encoding, members of archives and pictures, which are bytes, and handles of the
        # kernel.
        own |= ast.unparse(node.func) in ("reader.open", "archive.open", "Image.open", "os.open")
        if not own and len(node.args) < CALLS[name]:
            found.append(node.lineno)
    return found


@pytest.mark.parametrize("folder", ["affordance", "studies"])
def test_every_text_file_names_its_encoding(folder):
    paths = [path for path in SOURCES if path.is_relative_to(ROOT / folder)]
    assert len(paths) > 10
    found = {str(path): list_without_encoding(path.read_text(encoding="utf-8")) for path in paths}
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    ("call", "is_found"),
    [
        ("path.read_text()", True),
        ("path.write_text('x')", True),
        ("path.open('w')", True),
        ("open(path)", True),
        ("path.read_text(encoding='utf-8')", False),
        ("path.read_text('utf-8')", False),
        ("path.open('rb')", False),
        ("write_text(path, 'x')", False),
    ],
)
def test_calls_are_told_apart(call, is_found):
    assert bool(list_without_encoding(call)) is is_found


@pytest.mark.parametrize(("is_utf8", "status"), [("0", 2), ("1", 0)])
def test_a_locale_without_utf8_is_refused_in_one_line_that_says_what_to_set(is_utf8, status):
    own = {"LC_ALL": "C", "PYTHONUTF8": is_utf8, "PYTHONCOERCECLOCALE": "0"}
    command = [sys.executable, "-m", "affordance", "guess", "--help"]
    found = subprocess.run(command, env={**os.environ, **own}, cwd=ROOT, capture_output=True, check=False)
    assert found.returncode == status
    lines = found.stderr.decode().splitlines()
    assert len(lines) == (status == 2)
    assert all("Drake cannot be loaded; set PYTHONUTF8=1, or a locale such as LANG=C.UTF-8" in line for line in lines)
