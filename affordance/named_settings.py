"""Lists and changes settings by name, as in ``--set prior.sd=8000``.

A name is a path of fields, such as ``noise.weber_fraction``. ``noise.model`` selects the noise model and ``learner``
selects the learner. Their parameters are named after the fields of the selected model, such as ``learner.kappa``. The
arm has no name, because it belongs to a model folder.
"""

import enum
import inspect
import re
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from affordance.arguments import check_kind
from affordance.belief.learner import Learner
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice, suggest
from affordance.files.bounded import parse_yaml
from affordance.files.constraints import Setting, list_field_types
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.settings import DEFAULT_SETTINGS, Settings

# Values by name. The value can be a mapping from the remaining parts of names to values.
type Changes = Mapping[str, Any]

# Noise models by name.
NOISE_MODELS: Mapping[str, type[WeberNoise | WhiteNoise]] = {"weber": WeberNoise, "white": WhiteNoise}
NO_CHANGES: Changes = {}
_NOISE, _MODEL, _LEARNER = "noise", "model", "learner"
_NOISE_MODEL = f"{_NOISE}.{_MODEL}"
_MODEL_SOURCE = (
    "the just noticeable difference of a force is proportional to the force (docs/decisions/0004-noise.md)"
)


class NamedSetting(NamedTuple):
    """Setting with its name, value and meaning.

    Attributes:
        name: Path of fields.
        value: Current value.
        unit: Unit; "1" if dimensionless, empty if the value is not a number.
        source: Reference or reason for the default value.
        meaning: Description of the setting.
    """

    name: str
    value: float | str | bool | None
    unit: str
    source: str
    meaning: str


def list_settings(settings: Settings = DEFAULT_SETTINGS) -> list[NamedSetting]:
    """Lists all settings that can be changed by name."""
    return list(_walk(settings, ""))


def change_settings(settings: Settings, changes: Changes, source: Path | str = "settings") -> Settings:
    """Changes settings by name.

    Args:
        settings: Original settings.
        changes: Values by name, either flat, such as ``{"prior.sd": 8000}``, or nested: ``{"prior": {"sd": 8000}}``.
        source: Source of the changes, for errors. In a file, they are under the key ``settings``.

    Raises:
        BadValueError: A setting is unknown, or a value is of the wrong type or out of bounds.
    """
    check_kind("settings", settings, Settings, "Settings(...) makes them")
    check_kind("changes", changes, Mapping, "such as {'prior.sd': 8000}")
    prefix = "settings." if isinstance(source, Path) else ""
    flat = dict(_flatten(changes, ""))
    if _LEARNER in flat:
        flat = {_LEARNER: flat.pop(_LEARNER), **flat}  # first, because parameters depend on it
    if _NOISE_MODEL in flat:
        model = flat.pop(_NOISE_MODEL)
        if model not in list(NOISE_MODELS):  # a list, because values from YAML may not be hashable
            raise BadValueError(source, f"{prefix}{_NOISE_MODEL}", describe_choice(model, NOISE_MODELS))
        if not isinstance(settings.noise, NOISE_MODELS[model]):
            settings = replace(settings, noise=NOISE_MODELS[model]())
    for name, value in flat.items():
        known = [each.name for each in list_settings(settings)]
        if name not in known:
            raise BadValueError(source, f"{prefix}{name}", _describe_unknown(name, known))
        try:
            settings = _replace(settings, name.split("."), value)
        except BadArgumentError as error:
            raise BadValueError(source, f"{prefix}{name}", error.problem) from error
    return settings


def parse_changes(words: Sequence[str]) -> dict[str, Any]:
    """Parses words such as ``prior.sd=8000`` to values by name. Values are written in YAML.

    Raises:
        BadValueError: A word is not of this form, or a setting is named twice.
    """
    changes: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name.strip():
            raise BadValueError("--set", "", f"is {word!r}, must be NAME=VALUE, such as prior.sd=8000")
        if name.strip() in changes:
            raise BadValueError("--set", name.strip(), "is given twice")
        changes[name.strip()] = parse_value(text)
    return changes


def parse_value(text: str) -> Any:
    """Parses a value as in a settings file. Text that is not valid YAML is returned as it is."""
    try:
        return parse_yaml(text, "value")
    except BadValueError:
        return text


def describe_changes(settings: Settings) -> dict[str, Any]:
    """Returns the settings that differ from their defaults, by name."""
    default = {each.name: each.value for each in list_usual(settings)}
    return {each.name: each.value for each in list_settings(settings) if default.get(each.name, ...) != each.value}


def list_usual(settings: Settings) -> list[NamedSetting]:
    """Lists the default values of all settings, including the parameters of the current learner."""
    learner = [
        each
        for each in list_settings(replace(settings, learner=settings.learner.usual))
        if each.name.startswith(f"{_LEARNER}.")
    ]
    return [*list_settings(type(settings)()), *learner]


def show_setting(value: float | str | bool | None) -> str:
    """Formats a value as YAML, with up to twelve significant digits."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return value if isinstance(value, str) else f"{value:.12g}"


def _walk(holder: Any, prefix: str) -> Iterator[NamedSetting]:
    kind: Any = type(holder)
    meanings = read_meanings(kind)
    for name, hint in list_field_types(kind).items():
        value, path = getattr(holder, name), f"{prefix}{name}"
        notes = [each for each in typing.get_args(hint)[1:] if isinstance(each, Setting)]
        if notes:
            shown = value.value if isinstance(value, enum.Enum) else value
            shown = shown.name if isinstance(shown, Learner) else shown
            yield NamedSetting(path, shown, notes[0].unit, notes[0].source, meanings.get(name, ""))
            if isinstance(value, Learner):
                yield from _walk(value.parameters, f"{path}.")
        elif is_dataclass(value):
            for model, kind in NOISE_MODELS.items():
                if path == _NOISE and isinstance(value, kind):
                    yield NamedSetting(_NOISE_MODEL, model, "", _MODEL_SOURCE, "Model of torque errors.")
            yield from _walk(value, f"{path}.")


def _describe_unknown(name: str, known: Sequence[str]) -> str:
    """Describes an unknown name, and lists similar names."""
    siblings = [each for each in known if each.partition(".")[0] == name.partition(".")[0]]
    if siblings:
        return describe_choice(name, siblings)
    return f"is not a setting{suggest(name, known)} (docs/assumptions.md lists all)"


def _flatten(changes: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in changes.items():
        path = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{path}.")
        else:
            yield path, value


def _replace(holder: Any, path: Sequence[str], value: Any) -> Any:
    first, *others = path
    if isinstance(holder, Learner):
        return holder.change(**{first: value})
    return replace(holder, **{first: _replace(getattr(holder, first), others, value) if others else value})


def read_meanings(kind: type) -> dict[str, str]:
    """Extracts the descriptions of attributes from the docstring of a class."""
    _, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")
    return {
        name: " ".join(text.split())
        for name, text in re.findall(r"^    (\w+): (.*(?:\n     .*)*)", attributes, re.MULTILINE)
    }
