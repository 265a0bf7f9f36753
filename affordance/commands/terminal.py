"""Width, colours and elapsed time on a terminal."""

import os
import re
import shutil
import sys
import threading
import time
from typing import Any, TextIO

from affordance.exceptions import PROSE, show_text
from affordance.reporting.formatting import break_line

# Colours of a terminal, as parameters of ANSI's "select graphic rendition".
RED, GREEN, YELLOW = "31", "32", "33"
# Patterns of verdicts in answers, with the colour of each.
_VERDICTS = (
    (
        re.compile(
            r"NOT TO BE TRUSTED|NOT SEEN|\bis too heavy\b|\bdoes not work\b|\bmissing\b(?=[;:])|^not met\b", re.M
        ),
        RED,
    ),
    (re.compile(r"(?<=: )trusted$|(?<=in the hand )fits\b|^met\b|^The arms agree\b", re.M), GREEN),
    (re.compile(r"^ *warning:|^The arms differ\b", re.M), YELLOW),
)
# Time before the elapsed time is first shown, and between updates, [s].
_PATIENCE = 1.0


def find_width(stream: TextIO | None = None) -> int:
    """Finds the width of a stream's terminal, in characters; 0 if the stream is not a terminal.

    The default stream is standard output. If it is not a terminal, its width is the variable COLUMNS, if set.
    """
    if stream is None and os.environ.get("COLUMNS") and not sys.stdout.isatty():
        return shutil.get_terminal_size(fallback=(0, 0)).columns
    return shutil.get_terminal_size().columns if (stream or sys.stdout).isatty() else 0


def paint(text: str, colour: str, stream: TextIO) -> str:
    """Colours a text if the stream is a colour terminal and NO_COLOR is not set."""
    is_wanted = stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    return f"\033[{colour}m{text}\033[0m" if is_wanted else text


def format_error(program: str, problem: str, stream: TextIO) -> str:
    """Formats an error message as one line.

    On a terminal, the line is wrapped between words and its beginning is red.
    """
    lead = f"{program}:"
    lines = break_line(f"{lead} {problem}", find_width(stream))
    return "\n".join(lines).replace(lead, paint(lead, RED, stream), 1)


class ElapsedTime:
    """Shows a command's elapsed time in a terminal line on standard error, until ``end`` is called."""

    def __init__(self, name: str) -> None:
        """Starts the clock."""
        self._ended = threading.Event()
        self._stream = sys.stderr
        self._thread = threading.Thread(target=self._show, args=(name, time.perf_counter()), daemon=True)
        if self._stream.isatty():
            self._thread.start()

    def _show(self, name: str, start: float) -> None:
        is_shown = False
        while not self._ended.wait(_PATIENCE):
            # The cursor returns to the left, so that the next message overwrites the time.
            self._stream.write(f"{name}: {time.perf_counter() - start:.0f} s\r")
            self._stream.flush()
            is_shown = True
        if is_shown:
            self._stream.write("\033[K")
            self._stream.flush()

    def end(self) -> None:
        """Removes the line. Later calls have no effect."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()


class ShownOutput:
    """Standard output that replaces invisible characters and colours verdicts.

    The first text removes the line with the elapsed time, if there is one.
    """

    def __init__(self, stream: TextIO, elapsed: ElapsedTime | None = None) -> None:
        """Wraps a stream."""
        self._stream, self._elapsed = stream, elapsed

    def write(self, text: str) -> int:
        """Writes a text."""
        if self._elapsed is not None:
            self._elapsed.end()
        shown = show_text(text, PROSE)
        if not shown.lstrip().startswith(("{", "[")):  # JSON is for programs
            for words, colour in _VERDICTS:
                shown = words.sub(paint(r"\g<0>", colour, self._stream), shown)
        self._stream.write(shown)
        return len(text)

    def __getattr__(self, name: str) -> Any:
        """Delegates all other attributes to the stream."""
        return getattr(self._stream, name)


class QuietErrors:
    """Standard error that reports not to be a terminal, so that no progress is shown. Messages are not changed."""

    def __init__(self, stream: TextIO) -> None:
        """Wraps a stream."""
        self._stream = stream

    def isatty(self) -> bool:
        """Returns False, so that tqdm and ElapsedTime show nothing."""
        return False

    def __getattr__(self, name: str) -> Any:
        """Delegates all other attributes to the stream."""
        return getattr(self._stream, name)
