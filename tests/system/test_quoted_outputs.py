"""Outputs that pages quote are those of the commands above them; the slow ones are checked at a release."""

import ast
import re

import pytest

from affordance.commands.catalogue import COMMANDS, load_command
from affordance.commands.parser import OneLineParser
from affordance.files.model_folder import import_study
from docs.quoted_outputs import ROOT, is_same, leave_out, list_blocks, list_pages, remake, split_commands, split_words

PAGES = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in list_pages()}
# Pages that quote outputs; where all of them take minutes, only what prose repeats of them is compared.
QUOTING = [page for page, text in PAGES.items() if any(each.is_run for each in list_blocks(text))]
# Pages of first use, whose commands that are not run are parsed.
FIRST_USE = re.compile(r"README.md|docs/commands.md|docs/howto/.*|docs/gallery.*")


def list_unquoted(page, text):
    """Commands in a line of their own or between backticks or quotes; alternatives and remarks are left out."""
    lines = re.findall(r"^ {4,}(affordance (?:[^#\n]*\\\n)*[^#\n]*)", text, re.MULTILINE)
    if page in ("README.md", "docs/commands.md"):  # elsewhere names of commands are between backticks, too
        lines += re.findall(r"`(affordance [^`]*)`", text)
    lines += re.findall(r'"(affordance [^"]*)"', text)
    lines += [
        line
        for block in list_blocks(text)
        if block.language == "bash"
        for line in block.body.replace("\\\n", "").splitlines()
    ]
    commands = [part.strip() for line in lines for part in line.split(" && ")]
    return [each for each in commands if not re.search(r"\[|\||\.\.\.|COMMAND|NAME", each)]


def list_quoted(text):
    consoles = [block for block in list_blocks(text) if block.language == "console"]
    return [command for block in consoles for command, _ in split_commands(block.body)]


def list_commands():
    found = [command for text in PAGES.values() for command in list_quoted(text)]
    found += [
        command for page, text in PAGES.items() if FIRST_USE.match(page) for command in list_unquoted(page, text)
    ]
    # The page on commands shows one mistake; its output is compared above.
    return sorted({command for command in found if command.startswith("affordance") and "1e9" not in command})


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize("page", QUOTING)
def test_outputs_are_those_of_the_commands_above_them(page, tmp_path):
    assert remake(PAGES[page], tmp_path, minutes=False) == PAGES[page]


@pytest.mark.parametrize("command", list_commands())
def test_commands_are_such_as_the_program_takes(command):
    _, name, *words = split_words(command)
    parser = OneLineParser(prog=name)
    if name == "study":
        import_study(words.pop(0)).add_arguments(parser)
    else:
        assert name in COMMANDS
        load_command(name).add_arguments(parser)
    parser.parse(words)


def test_each_output_is_below_what_makes_it():
    for page, text in PAGES.items():
        blocks = list_blocks(text)
        quoted = [False, *(block.makes_next for block in blocks)]
        for block, is_made in zip(blocks, quoted, strict=False):
            assert block.language != "text" or is_made or block.file, f"{page}: {block.body}"


def test_messages_about_a_load_that_is_not_explained_are_those_of_the_program():
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "affordance/extensions/payload").rglob("*.py")]
    said = [
        node.value
        for source in sources
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    _, _, *messages = re.findall(r"^\| ([^|]+) \|", PAGES["docs/howto/unexplained_load.md"], re.MULTILINE)
    assert messages
    for message in messages:
        for part in re.split(r"(?:JOINT|SIGNAL):?|\d+ %?", message):
            assert any(part.strip() in text for text in said), f"{message}: {part}"


STALE = """\
<!-- file: prices.py -->
```python
print("to be run")
```

```console
$ python3 prices.py  # a remark
to be walked
$ affordance version
affordance 0.0.1
```

```python
print("1 of 3\\n2 of 3\\n3 of 3\\n2026-11-29")
```

```text
1 of 2
...
2026-01-01
```

<!-- minutes -->
```console
$ affordance nothing
```

It is <!--="(\\d) of 3"-->5<!--/--> of 3.
"""


def test_stale_page_is_remade(tmp_path):
    text = remake(STALE, tmp_path, minutes=False)
    changed = [line for line, old in zip(text.splitlines(), STALE.splitlines(), strict=True) if line != old]
    assert changed[0] == "to be run"
    assert re.fullmatch(r"affordance \d\.\d\.\d", changed[1])
    assert changed[2:] == ["1 of 3", "2026-11-29", 'It is <!--="(\\d) of 3"-->1<!--/--> of 3.']


def test_what_takes_minutes_is_made_at_a_release(tmp_path):
    assert "must be one of" in remake(STALE, tmp_path, minutes=True)


def test_what_needs_makers_files_is_made_where_they_are(tmp_path):
    page = "<!-- makers -->\n```console\n$ cat robots/a.urdf\nold\n```\n"
    robot = tmp_path / "makers" / "robots" / "a.urdf"
    robot.parent.mkdir(parents=True)
    robot.write_text("new\n")
    (tmp_path / "first").mkdir()
    assert remake(page, tmp_path / "first", minutes=True) == page
    (tmp_path / "second").mkdir()
    made = remake(page, tmp_path / "second", minutes=False, makers=tmp_path / "makers")
    assert made == page.replace("old", "new")


def test_only_the_day_may_differ(tmp_path):
    page = "```python\nprint('2026-11-29: 1')\n```\n\n```text\n2026-01-01: 1\n```\n"
    assert remake(page, tmp_path, minutes=False) == page


@pytest.mark.parametrize(
    ("other", "same"),
    [
        ("0.537 kg,  11 of 12", True),
        ("0.538 kg, 11 of 12", True),
        ("0.540 kg, 11 of 12", False),
        ("0.537 kg, 12 of 12", False),
        ("0.537 g, 11 of 12", False),
        ("0.54 kg, 11 of 12", True),
    ],
)
def test_last_digits_of_decimals_may_differ(other, same):
    assert is_same("0.537 kg, 11 of 12", other) == same


@pytest.mark.parametrize(
    ("shown", "left"),
    [
        ("a1\n...\nf1\n", "a 1\n...\nf 6\n"),
        ("...\nf1\n", "...\nf 6\n"),
        ("a1\n...\nc1\nd\n...\n", "a 1\n...\nc 3\nd 4\n...\n"),
    ],
)
def test_what_the_page_leaves_out_is_left_out(shown, left):
    assert leave_out("a 1\nb 2\nc 3\nd 4\ne 5\nf 6\n", shown) == left
