"""Outputs that pages quote, made by the commands above them: ``make numbers``; CONTRIBUTING.md explains the form."""

import argparse
import contextlib
import difflib
import io
import itertools
import logging
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from unittest import mock

from affordance.cli import main as run_program
from affordance.files.atomic import write_text

ROOT = Path(__file__).resolve().parents[1]
# Width of what is quoted, as on pages of the site, [characters].
WIDTH = 88
# Folders of the repository that commands on pages name.
_FOLDERS = ("models", "examples", "studies")
_BLOCK = re.compile(
    r"(?P<notes>(?:^<!-- .*? -->\n)*)^```(?P<language>[^\n]*)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL
)
_COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)\n", re.MULTILINE)
_REPEATED = re.compile(r'(?P<mark><!--="(?P<pattern>[^"]+)"-->)(?P<text>.*?)<!--/-->')
_LEFT_OUT = "..."
# What differs from run to run: days, and the time that a command took.
_CHANGING = re.compile(r"\d{4}-\d{2}-\d{2}|(?<=written in )[\d.]+ s")
# Another processor adds in another order, after which a sample may differ: numbers with decimals may differ by two in
# their last digit, or by this fraction.
_DECIMAL = re.compile(r"-?\d+\.(\d+)")
_ROUNDING = 2e-3


class Block(NamedTuple):
    """A fenced block of a page.

    Attributes:
        language: Language that the fence names.
        body: Lines between the fences.
        start, end: Place of the body in the page.
        file: Name of the file that has the block's text.
        needs: When it runs: "" always, "minutes" at a release, "makers" with makers' files (``--makers``), "outside"
            never.
        makes_next: A block of text follows, with what this one prints.
    """

    language: str
    body: str
    start: int
    end: int
    file: str
    needs: str
    makes_next: bool

    @property
    def is_run(self) -> bool:
        """True if an output of the block stands on the page."""
        return self.makes_next or self.language == "console"


def list_pages() -> list[Path]:
    """Lists the pages that may quote outputs."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def list_blocks(text: str) -> list[Block]:
    """Lists the fenced blocks of a page, in order."""
    found = [*_BLOCK.finditer(text)]
    blocks = []
    for block, after in itertools.zip_longest(found, found[1:]):
        follows = after is not None and after["language"] == "text" and not text[block.end() : after.start()].strip()
        file, needs = (
            re.search(rf"<!-- {note}", block["notes"]) for note in (r"file: (\S+)", r"(minutes|makers|outside)")
        )
        blocks.append(
            Block(
                block["language"],
                block["body"],
                block.start("body"),
                block.end("body"),
                file[1] if file else "",
                needs[1] if needs else "",
                block["language"] == "python" and follows,
            )
        )
    return blocks


def split_commands(body: str) -> list[tuple[str, str]]:
    """Splits a block of a console into its commands and the outputs that are shown below them."""
    before, *parts = _COMMAND.split(body)
    if before or not parts:
        raise ValueError(f"a block of a console begins with a command after '$ ', not with {before[:60]!r}")
    return list(zip(parts[::2], parts[1::2], strict=True))


def split_words(command: str) -> list[str]:
    """Splits a command as a shell does; remarks are left out."""
    return shlex.split(command.replace("\\\n", " "), comments=True)


@contextlib.contextmanager
def _capture() -> Iterator[io.StringIO]:
    """Captures all that is printed and logged, as lines that a terminal of the pages' width shows."""
    said, handlers = io.StringIO(), logging.root.handlers[:]
    logging.root.handlers[:] = []  # the program adds its own, which writes to the captured stream
    environment = {"COLUMNS": str(WIDTH), "TQDM_DISABLE": "1"}
    try:
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
            mock.patch.dict(os.environ, environment),
        ):
            yield said
    finally:
        logging.root.handlers[:] = handlers


def _run_command(command: str) -> str:
    """Runs a command in the working folder, in this process if it is the program's; returns what it prints."""
    words = split_words(command)
    with _capture() as said:
        if words[0] == "affordance":
            with contextlib.suppress(SystemExit):  # raised by the parser of options
                run_program(words[1:])
        else:
            options = {"shell": True, "text": True, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
            said.write(subprocess.run(command, check=False, **options).stdout)  # type: ignore[call-overload]
    return said.getvalue()


def _run_python(code: str) -> str:
    """Runs Python in the working folder; returns what it prints."""
    with _capture() as said:
        exec(code, {"__name__": "__main__"})
    return said.getvalue()


def leave_out(said: str, shown: str) -> str:
    """Leaves out of an output what the page leaves out of it.

    A line of three dots stands for any number of lines. What is shown before the first and after the last such line
    is as many lines of the output's beginning and end; what is between two of them is the most similar part.
    """
    lines, parts = said.splitlines(), [[]]  # type: tuple[list[str], list[list[str]]]
    for line in shown.splitlines():
        if line == _LEFT_OUT:
            parts.append([])
        else:
            parts[-1].append(line)
    if len(parts) == 1:
        return said
    found = ["\n".join(lines[: len(parts[0])])]
    place = len(parts[0])
    for part in parts[1:-1]:
        starts = range(place, max(place, len(lines) - len(part)) + 1)
        place = max(starts, key=lambda k: _compare(part, lines[k : k + len(part)]))
        found.append("\n".join(lines[place : place + len(part)]))
        place += len(part)
    found.append("\n".join(lines[len(lines) - len(parts[-1]) :]))
    return f"\n{_LEFT_OUT}\n".join(found).strip("\n") + "\n"


def _compare(shown: list[str], found: list[str]) -> float:
    """Measures how similar two parts of an output are, from 0 to 1."""
    return difflib.SequenceMatcher(None, "\n".join(shown), "\n".join(found)).ratio()


def _quote(said: str, shown: str) -> str:
    """Makes the text that is to stand on the page of an output; what is shown stays if it is the same."""
    for folder in (os.getcwd(), str(ROOT)):  # noqa: PTH109, as commands print it
        said = said.replace(f"{folder}/", "")
    said = "".join(f"{line.rstrip()}\n" for line in said.rstrip().splitlines())
    said = leave_out(said, shown)
    return shown if is_same(said, shown) else said


def is_same(one: str, other: str) -> bool:
    """Says whether two outputs differ in days, times and the rounding of decimals alone."""
    one, other = (" ".join(_CHANGING.sub("", text).split()) for text in (one, other))
    if _DECIMAL.sub("", one) != _DECIMAL.sub("", other):
        return False
    pairs = zip(_DECIMAL.finditer(one), _DECIMAL.finditer(other), strict=True)
    return all(
        abs(float(first[0]) - float(second[0]))
        <= max(2.01 * 10.0 ** -min(len(first[1]), len(second[1])), _ROUNDING * abs(float(first[0])))
        for first, second in pairs
    )


def remake(text: str, folder: Path, minutes: bool, makers: Path | None = None) -> str:
    """Remakes the outputs of a page, and what its prose repeats of them.

    Args:
        text: The page.
        folder: Empty folder, in which the page's blocks run in their order.
        minutes: Whether those that take minutes run, too.
        makers: Folder with clones of makers' repositories, which are copied; None leaves out what needs them.

    Returns:
        The page with the outputs that were found.
    """
    for name in _FOLDERS:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    if makers is not None and any(block.needs == "makers" for block in list_blocks(text)):
        shutil.copytree(makers, folder, ignore=shutil.ignore_patterns(".git"), dirs_exist_ok=True)
    left_out = {"outside", *([] if minutes else ["minutes"]), *([] if makers else ["makers"])}
    blocks, bodies, printed = list_blocks(text), [], ""
    with contextlib.chdir(folder):
        for block in blocks:
            body = block.body
            if block.file:
                Path(block.file).write_text(body, encoding="utf-8")
            if block.needs in left_out:
                printed = ""
            elif block.language == "console":
                pairs = split_commands(body)
                body = "".join(f"$ {command}\n{_quote(_run_command(command), shown)}" for command, shown in pairs)
            elif block.language == "text" and printed:
                body, printed = _quote(printed, body), ""
            elif block.makes_next:
                printed = _run_python(body)
            bodies.append(body)
    for block, body in reversed(list(zip(blocks, bodies, strict=True))):
        text = text[: block.start] + body + text[block.end :]
    outputs = "\n".join(
        body for block, body in zip(blocks, bodies, strict=True) if block.language in ("console", "text")
    )
    return _REPEATED.sub(lambda mark: _repeat(mark, outputs), text)


def _repeat(mark: re.Match[str], outputs: str) -> str:
    """Fills in what the mark's pattern finds in the outputs of the page, where lines may be broken anywhere."""
    found = re.search(mark["pattern"].replace(" ", r"\s+"), outputs)
    if found is None:
        raise ValueError(f"no output of the page has {mark['pattern']!r}")
    return f"{mark['mark']}{found[1]}<!--/-->"


def main() -> int:
    """Remakes the outputs of all pages or of those that are named; with --check, only says which would change."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("pages", nargs="*", type=Path, help="pages; all if none is named")
    parser.add_argument("--fast", action="store_true", help="leave out what takes minutes")
    parser.add_argument("--makers", type=Path, help="folder with the clones that docs/howto/three_arms.md names")
    parser.add_argument(
        "--check", action="store_true", help="change nothing; exit status 1 if something would change"
    )
    chosen = parser.parse_args()
    changed = False
    for page in [each.resolve() for each in chosen.pages] or list_pages():
        before = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            after = remake(before, Path(folder).resolve(), not chosen.fast, chosen.makers)
        if after != before:
            changed = True
            name = str(page.relative_to(ROOT))
            print("\n".join(difflib.unified_diff(before.splitlines(), after.splitlines(), name, name, "", "", 1, "")))
            if not chosen.check:
                write_text(page, after)
    return int(changed and chosen.check)


if __name__ == "__main__":
    sys.exit(main())
