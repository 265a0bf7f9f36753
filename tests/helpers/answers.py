"""What the command line answers, asked in this process."""

import contextlib
import io
import json
from typing import Any, NamedTuple

from affordance.cli import main


class Answer(NamedTuple):
    """Exit status of a command and what it wrote to standard output and standard error."""

    status: object
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Lines of the standard output."""
        return self.out.splitlines()

    @property
    def content(self) -> Any:
        """Content of the standard output, which is JSON."""
        return json.loads(self.out)


def answer(*words: object, status: int = 0) -> Answer:
    """Asks the command line, each word being an argument; the exit status must be as expected."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            ended: object = main([str(word) for word in words])
        except SystemExit as exit:  # raised by the parser of options
            ended = exit.code
    assert ended == status, err.getvalue()
    return Answer(ended, out.getvalue(), err.getvalue())
