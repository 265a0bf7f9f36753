"""English of docstrings, messages and pages: each line says what it is about, in the words of the field."""

import ast
import functools
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_OPENS = re.compile(r"(What|Which|Whether|How|Who|Those|That of|Of|Its|It|The same|As|Beside|So|Likewise)\b")
_SECTION = re.compile(r"^\s*(Args|Attributes|Raises|Input ports|Output ports|Parameters|Returns):")
# Words of our own; "there is none" and "is none of" are English.
_BANNED = re.compile(
    r"\b(((?i:besides?)|told apart|(?i:honest)|so many|is said|(is|are|was|were) told|goes on|hangs on|taken off)\b"
    r"|(?<![Tt]here )is none\b(?! of))"
)
# Published names and keys of files: conditions of protocols on their objects.
_KEYS = {"honest", "honest, ", "honest before the decoy"}
# Share of lines that may open so.
_MOST = 0.02
# Parts of a page that quote: blocks and spans of code, and expressions that fill in numbers.
_QUOTED = re.compile(r"```.*?```|`[^`\n]*`|<!--.*?-->|^(?:    |\t)[^\n]*$", re.DOTALL | re.MULTILINE)


@functools.cache
def parse_programs(folder):
    """Syntax trees of the modules of a folder, by path."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / folder).rglob("*.py"))}


@functools.cache
def list_docstrings(folder):
    """Docstrings of a folder, each with its place."""
    return [
        (f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}", text)
        for path, tree in parse_programs(folder).items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        if (text := ast.get_docstring(node, clean=True))
    ]


def list_entries(folder):
    """Lines below Args, Attributes and ports that describe one of them."""
    for place, text in list_docstrings(folder):
        inside = False
        for line in text.splitlines():
            if _SECTION.match(line):
                inside = not re.match(r"\s*(Raises|Returns):", line)
            elif inside and (found := re.match(r"^    [\w*\"]+(?:, [\w*\"]+)*: (?P<text>\S.*)$", line)):
                yield place, found["text"]


def list_messages(folder):
    """Texts in a folder's modules other than docstrings: what is raised, logged, printed, and shown as help."""
    for path, tree in parse_programs(folder).items():
        documented = {
            node.body[0].value
            for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node)
        }
        for node in set(ast.walk(tree)) - documented:
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value not in _KEYS:
                yield f"{path.relative_to(ROOT)}:{node.lineno}", node.value


def list_pages():
    """Lines of the pages, without what they quote."""
    for path in [
        ROOT / "README.md",
        *sorted((ROOT / "docs").glob("*.md")),
        *sorted((ROOT / "docs/howto").glob("*.md")),
    ]:
        for line in _QUOTED.sub("", path.read_text(encoding="utf-8")).splitlines():
            yield str(path.relative_to(ROOT)), line


def check_share(found):
    """Asserts that few of the lines open with a word that needs the line above."""
    wrong = [f"{place}: {text.splitlines()[0]}" for place, text in found if _OPENS.match(text)]
    assert len(wrong) <= _MOST * len(found), "\n".join([f"{len(wrong)} of {len(found)}", *wrong])


@pytest.mark.parametrize("folder", ["affordance", "studies"])
def test_first_sentences_stand_by_themselves(folder):
    check_share(list_docstrings(folder))


@pytest.mark.parametrize("folder", ["affordance", "studies"])
def test_arguments_are_described_by_a_noun(folder):
    check_share(list(list_entries(folder)))


@pytest.mark.parametrize(
    "list_texts",
    [
        *(functools.partial(list_docstrings, folder) for folder in ("affordance", "studies")),
        *(functools.partial(list_messages, folder) for folder in ("affordance", "studies")),
        list_pages,
    ],
)
def test_words_of_our_own_are_not_used(list_texts):
    texts = list(list_texts())
    assert len(texts) > 100
    found = [f"{place}: {line}" for place, text in texts for line in text.splitlines() if _BANNED.search(line)]
    assert not found, "\n".join(found)
