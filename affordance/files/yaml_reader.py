"""Reading YAML files: a key twice is a mistake, and so is more than files of settings need."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from affordance.exceptions import BadValueError
from affordance.files.bounded import SETTINGS, read_text

# Entries and levels of a file: of ours the largest has 720 and 10, and 100000 entries take seconds to read. A text
# counts as one more entry for every so many letters.
_MOST_ENTRIES, _MOST_DEEP, _ENTRY_LENGTH = 100_000, 40, 100
# Characters of a number: the largest double, written without an exponent, has 309.
_MOST_DIGITS = 1000


def read_yaml(path: Path) -> Any:
    """Parses a YAML file; what it holds is checked by ``files.data_model``, or taken out of a ``Record``.

    Raises:
        BadValueError: The file cannot be read, is not YAML, names a key twice, or is larger or deeper than files are.
    """
    loader = _open(path)
    with _translate(path):
        return loader.get_single_data()


def check_yaml(path: Path) -> None:
    """Makes sure that a file that another program reads, with tags of its own, is YAML of a reasonable size.

    Raises:
        BadValueError: As of ``read_yaml``.
    """
    loader = _open(path)
    with _translate(path):
        loader.get_single_node()


def _open(path: Path) -> "_Loader":
    text = read_text(path, SETTINGS)
    with _translate(path):
        return _Loader(text)


@contextmanager
def _translate(path: Path) -> Iterator[None]:
    """Turns what PyYAML raises into our error."""
    try:
        yield
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        refused = isinstance(error, _Refusal)
        raise BadValueError(path, where, f"{'' if refused else 'is not YAML: '}{error.problem}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not YAML: {error}") from error


class _Refusal(yaml.MarkedYAMLError):
    """YAML as it may be, but more of it than files of settings need."""


class _Loader(yaml.SafeLoader):
    """Reads numbers such as 1e-3 as YAML 1.2 does, rejects a key given twice, and what is too much or too deep.

    An alias stands for all that its anchor holds. Nine lines of them stand for more than fits into any memory, so
    entries are counted as often as they are named.
    """

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = self._entries = 0
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Composes a node, and counts the entries that it stands for."""
        mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
        is_alias = self.check_event(yaml.events.AliasEvent)
        before, self._depth = self._entries, self._depth + 1
        if self._depth > _MOST_DEEP:
            raise _Refusal(problem=f"is more than {_MOST_DEEP} levels deep", problem_mark=mark)
        node: yaml.Node | None = super().compose_node(parent, index)
        if is_alias:
            if id(node) not in self._sizes:
                raise _Refusal(problem="is an alias inside of its own anchor", problem_mark=mark)
            self._entries += self._sizes[id(node)]
        else:
            self._entries += 1 + (len(node.value) // _ENTRY_LENGTH if isinstance(node, yaml.ScalarNode) else 0)
        if self._entries > _MOST_ENTRIES:
            problem = f"makes more than {_MOST_ENTRIES} entries, aliases counted as often as they are named"
            raise _Refusal(problem=problem, problem_mark=mark)
        self._sizes[id(node)] = self._entries - before
        self._depth -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            try:
                twice = key in seen
            except TypeError:  # a list or a mapping, which PyYAML refuses below
                break
            if twice:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {show_value(key)} twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> int | float:
        """Takes a number of any size that has a meaning."""
        if len(node.value) > _MOST_DIGITS:
            problem = f"is a number of {len(node.value)} characters, must have at most {_MOST_DIGITS}"
            raise _Refusal(problem=problem, problem_mark=node.start_mark)
        if node.tag.endswith(":int"):
            return self.construct_yaml_int(node)
        return self.construct_yaml_float(node)


for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"), list("-+.0123456789")
)


def show_value(value: Any) -> str:
    """Describes a value in a few words, however long it is."""
    if value is None:
        return "empty"
    try:
        text = repr(value)
    except ValueError:  # Python does not write whole numbers of more than 4300 digits
        text = "a whole number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."
