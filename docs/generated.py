"""Parts of pages that are generated from the program: ``<!-- generated: NAME -->`` in a page becomes the part.

In ``<!-- toctree -->`` the pages that are linked between the last heading and the mark become chapters of the site.
With ``<!-- search: WORDS, WORDS -->`` the site's search finds the page first for these words.
"""

import argparse
import contextlib
import importlib
import inspect
import itertools
import json
import pkgutil
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

import yaml
from pydantic import BaseModel

import affordance
from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.commands.catalogue import COMMANDS, Command, load_command
from affordance.commands.parser import OneLineParser
from affordance.exceptions import AffordanceError
from affordance.extensions.payload.settings import PRIORS, IdentificationSettings, SignalKind
from affordance.extensions.pixels.seen_tool import ERROR
from affordance.files.constraints import Setting
from affordance.files.model_folder import import_study, list_studies
from affordance.named_settings import list_settings, read_meanings, show_setting
from affordance.proprioception.faults import Faults

_MARK = re.compile(r"^<!-- generated: (?P<part>\w+) -->$", re.MULTILINE)
_CHAPTERS = re.compile(r"^(#+ (?P<title>[^\n]*)\n(?P<text>(?:(?!^#)[\s\S])*?))<!-- toctree -->$", re.MULTILINE)
_SEARCHED = re.compile(r"^<!-- search: (?P<words>.*) -->$", re.MULTILINE)
_DOCUMENT = re.compile(r"\bdocs/([\w/-]+)\.md")
_ROOT = Path(__file__).parents[1]
# Files that users write or edit, and the model that reads each.
_FORMATS = {
    "tools/*.yaml, an entry of `tools`": "affordance.objects.tool_entries.ToolEntry",
    "materials.yaml, an entry": "affordance.objects.materials.MaterialEntry",
    "paths/*.yaml, or another file of `kind: reach` or `kind: mash`": "affordance.control.timed_path.PathEntry",
    "nail.yaml, or another file of `kind: hammer`": "affordance.choice.hammer.HammerEntry",
    "tasks/carry.yaml, or another file of `kind: carry`": "affordance.choice.carry.CarryEntry",
    "tasks/hold.yaml, or another file of `kind: hold`": "affordance.choice.carry.KeepEntry",
    "RUN.yaml, which describes the recording RUN.csv": "affordance.extensions.payload.recording.run_entry.RunEntry",
    "The payload on a controller, of `--claimed`": "affordance.extensions.payload.payload_setting.PayloadEntry",
    "gains.yaml, of `identify` and `--gains`": "affordance.extensions.payload.evidence.gains._GainsEntry",
    "faults.yaml, an entry, of `--fault`": "affordance.proprioception.faults._FaultsEntry",
}
# Models whose keys are those of a class, which says what they mean.
_MEANINGS = {"_FaultsEntry": Faults}


# Number of claims that are named with an assumption; the page on robustness has all.
_MOST_MOVED = 3

# Assumption of the study of robustness, by the settings that it changes, where names differ.
_CHANGED_BY = {
    "prior.deviation": "deviation",
    "noise.model": "noise_structure",
    "noise.independent_samples": "noise_structure",
    "sample_period": "noise_structure",
    "noise.weber_fraction": "weber_fraction",
    "noise.threshold": "threshold",
    "mpc.horizon": "horizon",
}


def fill_marks(text: str) -> str:
    """Replaces the marks of a page by what they name."""
    text = _SEARCHED.sub(lambda mark: f"```{{index}} ! {mark['words'].replace(', ', ', ! ')}\n```", text)
    return _CHAPTERS.sub(_add_chapters, _MARK.sub(lambda mark: PARTS[mark["part"]](), text))


def _add_chapters(section: re.Match[str]) -> str:
    links = re.findall(r"\[([^\]]+)\]\(([^)#:]+)\.(?:md|ipynb)\)", section["text"])
    # A page that introduces a folder has the name of the folder as its title.
    pages = [f"{text} <{page}>" if page.endswith("README") else page for text, page in links]
    return "\n".join([section[1], "```{toctree}", ":hidden:", f":caption: {section['title']}", "", *pages, "```"])


def format_rows(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Formats a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    cells = [[" ".join(str(cell).split()).replace("|", "\\|") for cell in row] for row in lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)


def list_names() -> str:
    """Names at the top of the package, by the folder that defines them: links to classes, functions; data last."""
    names = [name for name in affordance.__all__ if callable(getattr(affordance, name))]
    places = {name: getattr(affordance, name).__module__.split(".")[1] for name in names}
    parts = []
    for folder, group in itertools.groupby(sorted(names, key=lambda name: places[name]), places.__getitem__):
        of_folder = list(group)
        lead = (importlib.import_module(f"affordance.{folder}").__doc__ or "").partition("\n")[0]
        classes = [
            (f"[{name}](api/{name}.md)", _get_first_line(name)) for name in of_folder if name in list_classes()
        ]
        functions = [f".. autofunction:: affordance.{name}" for name in of_folder if name not in list_classes()]
        part = [f"## affordance.{folder}", lead]
        part += [format_rows(["class", "what it is"], classes)] if classes else []
        part += ["```{eval-rst}", "\n\n".join(functions), "```"] if functions else []
        parts.append("\n\n".join(part))
    data = {
        "MODELS": ":type: pathlib.Path\n\n   Folder of the models that come with the package.",
        "__version__": ":type: str\n\n   Version of the package.",
    }
    entries = "\n\n".join(f".. py:data:: affordance.{name}\n   {text}" for name, text in data.items())
    parts.append(f"## Data\n\n```{{eval-rst}}\n{entries}\n```")
    parts.append("```{toctree}\n:hidden:\n:glob:\n\napi/*\n```")
    return "\n\n".join(parts)


def list_classes() -> list[str]:
    """Classes at the top of the package, each of which has a page of its own."""
    return [name for name in affordance.__all__ if inspect.isclass(getattr(affordance, name))]


def _get_first_line(name: str) -> str:
    line = (inspect.getdoc(getattr(affordance, name)) or "").partition("\n")[0]
    return _DOCUMENT.sub(r"[\1](../\1.md)", line)


def link_documents(lines: list[str]) -> None:
    """Links the pages that the lines of a docstring name."""
    lines[:] = [_DOCUMENT.sub(r":doc:`\1 </docs/\1>`", line) for line in lines]


def describe_class(name: str) -> str:
    """Page of a class: what it is, its example, arguments and methods, from its docstrings."""
    # What a class inherits from one that has no page of its own is listed with it.
    hidden = {
        each
        for each in getattr(affordance, name).__mro__
        if each.__module__.startswith("affordance.") and each.__name__ not in affordance.__all__
    }
    inherits = any(not member.startswith("_") for each in hidden for member in vars(each))
    lines = [f".. autoclass:: affordance.{name}", "   :members:", *["   :inherited-members:"] * inherits]
    return "\n".join([f"# {name}", "", "```{eval-rst}", *lines, "```", ""])


def list_commands() -> str:
    """Every command with its usage and options."""
    return "\n\n".join(_describe_command(name, entry.help, load_command(name)) for name, entry in COMMANDS.items())


def describe_studies() -> str:
    """Every study with its usage and options."""
    studies = {name: import_study(name) for name in list_studies()}
    return "\n\n".join(_describe_command(f"study {name}", study.HELP, study) for name, study in studies.items())


def _describe_command(name: str, text: str, command: Command) -> str:
    parser = OneLineParser(prog=f"affordance {name}", description=text, add_help=False)
    command.add_arguments(parser)
    options = [action for action in parser._actions if action.help is not argparse.SUPPRESS]
    rows = [(f"`{_name_option(parser, each)}`", each.help or "") for each in options]
    table = [format_rows(["argument", "meaning"], rows)] if rows else []
    return "\n\n".join([f"## {name}", f"`affordance {name}`: {text}.", *table])


def _name_option(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    value = parser._get_formatter()._format_args(action, action.dest.upper()) if action.nargs != 0 else ""
    return f"{', '.join(action.option_strings)} {value}".strip()


def list_assumptions() -> str:
    """Lists each assumption that the study of robustness varies: range, source, and the claims that it moves most."""
    kept = json.loads((_ROOT / "docs" / "robustness.json").read_text(encoding="utf-8"))
    rows = []
    for name, entry in _read_assumptions().items():
        span = entry.get("range") or entry["choices"]
        shown = " to ".join(f"{each:g}" for each in span) if "range" in entry else ", ".join(map(str, span))
        rows.append((entry["label"], _show(entry["default"]), shown, _name_moved(kept, name), _link(entry["source"])))
    return format_rows(["assumption", "value", "varied over", "claims that it moves most", "source"], rows)


def list_all_settings() -> str:
    """Every setting with value, unit, source and the claims that it moves most."""
    kept = json.loads((_ROOT / "docs" / "robustness.json").read_text(encoding="utf-8"))
    varied = _read_assumptions()
    rows = []
    for each in list_settings():
        name = _CHANGED_BY.get(each.name, each.name.replace(".", "_"))
        moved = _name_moved(kept, name) if name in varied else "not varied"
        unit = "" if each.unit == "1" else each.unit
        rows.append((f"`{each.name}`", _show(each.value), unit, each.meaning, moved, _link(each.source)))
    return format_rows(["setting", "value", "unit", "meaning", "claims that it moves most", "source"], rows)


def list_identification() -> str:
    """Every assumption of identification with value, unit and source."""
    priors = [(kind.value, PRIORS[kind]) for kind in SignalKind]
    rows = [*_list_fields("", IdentificationSettings())]
    rows += [row for kind, prior in priors for row in _list_fields(f"{kind}: ", prior)]
    return format_rows(_OF_FIELDS, rows)


def list_learners() -> str:
    """Every assumption of learners with kinds, and of what pictures and drawings are off by, with unit and source."""
    rows = [*_list_fields("kinds, most probable: ", KINDS_MAP.parameters)]
    rows += [row for row in _list_fields("kinds, drawn: ", KINDS_DRAWN.parameters) if "kappa" in row[0]]
    return format_rows(_OF_FIELDS, [*rows, *_list_fields("solids seen from two sides: ", ERROR)])


def _list_fields(lead: str, holder: Any) -> Iterator[tuple[str, str, str, str, str]]:
    """Fields of settings that have a source, each with value, unit, meaning and source."""
    meanings = read_meanings(type(holder))
    for name, hint in get_type_hints(type(holder), include_extras=True).items():
        for note in get_args(hint)[1:]:
            if isinstance(note, Setting):
                unit = "" if note.unit == "1" else note.unit
                shown = _show(getattr(holder, name))
                yield f"{lead}`{name}`", shown, unit, meanings.get(name, ""), _link(note.source)


def _show(value: float | str | bool | None) -> str:
    """Formats a value; fractions with four significant digits."""
    is_fraction = isinstance(value, float) and not value.is_integer()
    return show_setting(float(f"{value:.4g}") if is_fraction else value)


def _link(source: str) -> str:
    """Links the pages of docs/ and the decisions that a source names."""
    linked = _DOCUMENT.sub(r"[\1](\1.md)", source)
    pages = {path.name[:4]: path.name for path in (_ROOT / "docs" / "decisions").glob("0*.md")}
    return re.sub(r"\b00\d\d\b(?!-)", lambda number: f"[{number[0]}](decisions/{pages[number[0]]})", linked)


def _read_assumptions() -> dict[str, Any]:
    text = (_ROOT / "studies" / "robustness" / "assumptions.yaml").read_text(encoding="utf-8")
    found: dict[str, Any] = yaml.safe_load(text)
    return found


def _name_moved(kept: dict[str, Any], name: str) -> str:
    """Names the three claims that an assumption explains best, with the shares of settings at their extremes."""
    claims = {key: each for key, each in kept["claims"].items() if each["strongest_assumption"] == name}
    moved = sorted(claims, key=lambda key: -claims[key]["strongest_index"])
    levels = {key: [100.0 * share for share in claims[key]["holds_by_level"].values()] for key in moved[:_MOST_MOVED]}
    named = [f"`{key}` {min(shares):.0f} to {max(shares):.0f} %" for key, shares in levels.items()]
    return ", ".join(named + [f"{len(moved) - len(named)} more"] * (len(moved) > len(named))) or "none"


def list_formats() -> str:
    """Keys of the files that users write, from the models that read them."""
    return "\n\n".join(f"## {title}\n\n{_describe_model(_find(place))}" for title, place in _FORMATS.items())


def _find(place: str) -> type[BaseModel]:
    module, _, name = place.rpartition(".")
    found: type[BaseModel] = getattr(importlib.import_module(module), name)
    return found


def _describe_model(model: type[BaseModel]) -> str:
    schema = model.model_json_schema(by_alias=True)
    for key, meaning in read_meanings(_MEANINGS.get(model.__name__, object)).items():
        schema["properties"][key]["description"] = meaning
    parts = [(schema.get("description", ""), schema)]
    parts += [(f"**{name}**: {each.get('description', '')}", each) for name, each in schema.get("$defs", {}).items()]
    tables = [(lead, list(_list_keys(each, schema.get("$defs", {})))) for lead, each in parts]
    return "\n\n".join(f"{lead}\n\n{format_rows(_KEYS, rows)}" for lead, rows in tables if rows)


_KINDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
    "object": "mapping",
    "array": "list",
}
_OF_FIELDS = ["assumption", "value", "unit", "meaning", "source"]
_KEYS = ["key", "value", "if left out", "meaning"]


def _list_keys(schema: dict[str, Any], named: dict[str, Any]) -> Iterator[tuple[str, str, str, str]]:
    required = schema.get("required", [])
    for key, entry in schema.get("properties", {}).items():
        default = "must be given" if key in required else f"`{json.dumps(entry.get('default'))}`"
        shown = "" if default == "`null`" else default
        meaning = entry.get("description") or _find_meaning(entry, named)
        yield f"`{key}`", _describe_type(entry, named), shown, meaning


def _find_meaning(entry: dict[str, Any], named: dict[str, Any]) -> str:
    """Finds the first sentence about the mapping, or the mappings of a list, that a key holds."""
    for each in (entry, *entry.get("anyOf", []), entry.get("items", {})):
        if "$ref" in each:
            described: str = named[each["$ref"].rpartition("/")[2]].get("description", "")
            return described.split("\n\n")[0]
    return ""


def _describe_type(entry: dict[str, Any], named: dict[str, Any]) -> str:
    if "$ref" in entry:
        name = entry["$ref"].rpartition("/")[2]
        return str(name) if "properties" in named[name] else _describe_type(named[name], named)
    if "enum" in entry or "const" in entry:
        return ", ".join(f"`{each}`" for each in entry.get("enum", [entry.get("const")]))
    choices = [each for each in entry.get("anyOf") or entry.get("oneOf") or () if each.get("type") != "null"]
    if choices:
        return " or ".join(dict.fromkeys(_describe_type(each, named) for each in choices))
    if entry.get("type") == "array":
        least, most = entry.get("minItems"), entry.get("maxItems")
        inner = (entry.get("prefixItems") or [entry.get("items", {})])[0]
        return f"list of {f'{least}, each a ' if least == most and least else ''}{_describe_type(inner, named)}"
    if isinstance(entry.get("additionalProperties"), dict):
        return f"mapping to {_describe_type(entry['additionalProperties'], named)}"
    kinds = entry.get("type", [])
    bounds = f" from {entry['minimum']:g} to {entry['maximum']:g}" if {"minimum", "maximum"} <= set(entry) else ""
    return " or ".join(
        f"{_KINDS[each]}{bounds}" for each in ([kinds] if isinstance(kinds, str) else kinds) if each != "null"
    )


def list_errors() -> str:
    """Every error that the package raises for the input of a user, with its base, its meaning and its parts."""
    for module in pkgutil.walk_packages(affordance.__path__, "affordance."):
        if not module.name.endswith("__main__"):
            with contextlib.suppress(ModuleNotFoundError):  # of an extra that is not installed; it defines no error
                importlib.import_module(module.name)
    rows = [_describe_error(each) for each in _walk_errors(AffordanceError)]
    return format_rows(["error", "kind of", "meaning", "parts"], rows)


def _walk_errors(base: type[AffordanceError]) -> Iterator[type[AffordanceError]]:
    yield base
    for each in base.__subclasses__():
        yield from _walk_errors(each)


def _describe_error(error: type[AffordanceError]) -> tuple[str, str, str, str]:
    parts = ", ".join(getattr(error, "__dataclass_fields__", {}))
    meaning = (inspect.getdoc(error) or "").splitlines()[0]
    bases = ", ".join(base.__name__ for base in error.__bases__)
    return f"`{error.__name__}`", bases, meaning, parts


PARTS: dict[str, Callable[[], str]] = {
    "names": list_names,
    "commands": list_commands,
    "studies": describe_studies,
    "assumptions": list_assumptions,
    "settings": list_all_settings,
    "identification": list_identification,
    "learners": list_learners,
    "formats": list_formats,
    "errors": list_errors,
}
