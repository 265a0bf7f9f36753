"""English of docstrings: every line of one says what it is about, as a tooltip shows each alone."""

import ast
import functools
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
_OPENS = re.compile(r"(What|Which|Whether|How|Who|Those|That of|Of|Its|It|The same|As|Beside|So|Likewise)\b")
_ENTRY = re.compile(r"^\s+[\w*\"., ]+: (?P<text>\S.*)$")
_SECTION = re.compile(r"^\s*(Args|Attributes|Raises|Input ports|Output ports|Parameters|Returns):")
_BANNED = re.compile(r"\b([Bb]esides?|is told|are told|is said|is none|so many|goes on|hangs on|taken off)\b")
# Share of lines that may open so.
_MOST = 0.02


@functools.cache
def list_docstrings():
    """Docstrings of the package, each with its place."""
    return list(walk_docstrings())


def walk_docstrings():
    for path in sorted((ROOT / "affordance").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node, clean=True)
                if text:
                    yield f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}", text


def list_entries():
    """Lines below Args, Attributes and ports that describe one of them."""
    for place, text in list_docstrings():
        inside = False
        for line in text.splitlines():
            if _SECTION.match(line):
                inside = not re.match(r"\s*(Raises|Returns):", line)
            elif inside and (found := re.match(r"^    [\w*\"]+(?:, [\w*\"]+)*: (?P<text>\S.*)$", line)):
                yield place, found["text"]
            elif not line.strip():
                continue


def check_share(found):
    """Asserts that few of the lines open with a word that needs the line above."""
    wrong = [f"{place}: {text.splitlines()[0]}" for place, text in found if _OPENS.match(text)]
    assert len(wrong) <= _MOST * len(found), "\n".join([f"{len(wrong)} of {len(found)}", *wrong])


def test_first_sentences_stand_by_themselves():
    check_share(list_docstrings())


def test_arguments_are_described_by_a_noun():
    check_share(list(list_entries()))


def test_words_of_our_own_are_not_used():
    found = [(place, line) for place, text in list_docstrings() for line in text.splitlines() if _BANNED.search(line)]
    assert len(found) <= 0.002 * len(list_docstrings()), "\n".join(f"{place}: {line}" for place, line in found)
