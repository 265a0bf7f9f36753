"""Expected mass, centre of mass and inertia of an object before it is held."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.arguments import check_kind
from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.pricing import Amount
from affordance.choice.weighed import Surprise, WeighedObject, condition_object, draw_drawing_errors
from affordance.objects.colour import show_colour
from affordance.objects.tool import Tool
from affordance.reporting.formatting import format_number, tabulate_within
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.prediction import measure_geometry

# Number and seed of evenly spread samples. Ends of intervals are accurate to about 0.1 %.
_NUM_SAMPLES, _SEED = 10_000, 0


class ExpectedBody(NamedTuple):
    """Expected inertia of an object or part in the object frame.

    Attributes:
        name: Name of the object or, for a part, of its apparent material; in pictures, the name of the part's colour.
        mass: Mass, [kg].
        com: Coordinates of the centre of mass, [m].
        inertia: Moments Ixx, Iyy, Izz and products Ixy, Ixz, Iyz about the centre of mass, [kg m^2].
    """

    name: str
    mass: Amount
    com: tuple[Amount, Amount, Amount]
    inertia: tuple[Amount, ...]


class Expectation(NamedTuple):
    """Expected inertia of an object and its parts, as means and 90 % intervals.

    Attributes:
        whole: Expected inertia of the whole object.
        parts: Expected inertia of each part, in the order of the tool's components.
        surprises: Weighings that contradict the drawing and the materials.

    Example:
        >>> from affordance import MODELS, MaterialMemory, expect, load_tools
        >>> hammer, *_ = load_tools(MODELS / "workshop" / "tools.yaml")
        >>> known = MaterialMemory.from_densities({"oak": 700, "cast_steel": 7800})
        >>> expected = expect(hammer, known)
        >>> print([f"{part.name}: {part.mass.mean:.2f} kg" for part in expected.parts])
        ['oak: 0.11 kg', 'cast_steel: 0.49 kg']
    """

    whole: ExpectedBody
    parts: tuple[ExpectedBody, ...]
    surprises: tuple[Surprise, ...] = ()


def expect(
    tool: Tool,
    memory: MaterialMemory,
    settings: Settings = DEFAULT_SETTINGS,
    features: Sequence[ComponentFeatures] | None = None,
) -> Expectation:
    """Predicts the inertia of an object from its appearance and weighings, before it is held.

    Weighings update both the densities and the errors of the drawing.

    Args:
        tool: Seen object; its true densities are not used.
        memory: Belief about materials, for example from ``TrialRunner.start_memory`` or ``Ledger.recall``.
        settings: Settings; only the prior of unknown materials is used.
        features: Observed shapes of the parts; None for the shapes and errors of the drawing.

    Raises:
        BadArgumentError: An argument has the wrong type.
    """
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some")
    check_kind("memory", memory, MaterialMemory, "MaterialMemory() knows nothing yet")
    check_kind("settings", settings, Settings)
    seen = measure_drawing(tool) if features is None else features
    recalled = memory.recall([part.appearance for part in seen], settings.prior)
    rng = np.random.default_rng(_SEED)
    densities, surprises = recalled.densities, tuple[Surprise, ...]()
    weighings = tuple(each for each in tool.weighings if len(seen) == len(tool.components) or not each.parts)
    geometry = measure_geometry(seen, range(len(seen)), len(seen))
    if weighings:
        weighed = WeighedObject(seen, recalled.columns, geometry, weighings)
        densities, surprises = condition_object(densities, tool.name, weighed, settings.prior)
    drawn = densities.draw_samples(rng, _NUM_SAMPLES, is_even=True)
    rho = drawn[:, list(recalled.columns)]  # (S, parts)
    if weighings:
        errors = draw_drawing_errors(weighed, rho, rng)
    else:
        errors = rng.standard_normal((_NUM_SAMPLES, len(geometry.Phi_errors)))
    bodies = []
    for number in range(len(seen)):
        alone = np.zeros_like(rho)
        alone[:, number] = rho[:, number]
        bodies.append(geometry.compute_parameters(alone, errors))
    shown = {part.looks_like.colour: part.looks_like.name for part in tool.components}
    names = [shown.get(part.colour) or show_colour(part.colour) for part in seen]
    parts = tuple(_summarise(name, pi) for name, pi in zip(names, bodies, strict=True))
    return Expectation(_summarise(tool.name, np.sum(bodies, axis=0)), parts, surprises)


def _summarise(name: str, pi: Array) -> ExpectedBody:
    """Summarises samples of the ten inertial parameters, (S, 10)."""
    mass = pi[:, 0]
    com = pi[:, 1:4] / np.where(mass > 0.0, mass, np.nan)[:, None]
    com = np.where(np.isfinite(com), com, np.nanmean(com, axis=0))  # a sample without mass has no centre of mass
    x, y, z = com.T
    shift = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    about = pi[:, 4:] - mass[:, None] * np.column_stack(shift)
    return ExpectedBody(
        name,
        Amount.of(mass),
        (Amount.of(x), Amount.of(y), Amount.of(z)),
        tuple(Amount.of(column) for column in about.T),
    )


# Order in which columns are dropped if the table is too wide: moments, then y, z and x of the centre of mass.
_LESS_IMPORTANT = (7, 6, 5, 3, 4, 2)
_HEADER = ("", "mass (kg)", "x (mm)", "y (mm)", "z (mm)", "Ixx (kg cm²)", "Iyy", "Izz")
# Smallest intervals that are shown, as a fraction of the mean and as a length, [m]. Drawings are not more precise.
_EXACT, _EXACT_LENGTH = 0.02, 1e-3


def build_expectations(expected: Sequence[Expectation]) -> list[dict[str, Any]]:
    """Builds the JSON content of expected inertias, in SI units and in the given order."""
    return [{**_build(each.whole), "parts": [_build(part) for part in each.parts]} for each in expected]


def _build(body: ExpectedBody) -> dict[str, Any]:
    axes = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    return {
        "name": body.name,
        "mass": body.mass._asdict(),
        "com": {axis: each._asdict() for axis, each in zip("xyz", body.com, strict=True)},
        "inertia": {axis: each._asdict() for axis, each in zip(axes, body.inertia, strict=True)},
    }


def describe_expectations(
    content: Sequence[Mapping[str, Any]], width: int = 0, *, by_part: bool = False
) -> list[str]:
    """Formats expected masses, centres of mass and moments of inertia as a table.

    Moments are about the centre of mass; all axes are parallel to the object frame.

    Args:
        content: Content from ``build_expectations``.
        width: Width of the terminal, which limits the table; 0 for no limit.
        by_part: True to add one line per part.
    """
    rows = [list(_HEADER)]
    for each in content:
        rows.append(_list_cells(each["name"], each))
        if by_part and len(each["parts"]) > 1:
            rows += [_list_cells(f"  {n}: {part['name']}", part) for n, part in enumerate(each["parts"], start=1)]
    title = "Expected before anything is held: mass, centre of mass, moments of inertia about it (90 % intervals)."
    table = tabulate_within(rows, max(width - 2, 1) if width else 0, _LESS_IMPORTANT)
    return [title, *(f"  {line}" for line in table)]


def _list_cells(name: str, body: Mapping[str, Any]) -> list[str]:
    centre = [_show_amount(each, 1e3, fixed=True) for each in body["com"].values()]
    moments = [_show_amount(body["inertia"][axis], 1e4) for axis in ("Ixx", "Iyy", "Izz")]
    return [name, _show_amount(body["mass"]), *centre, *moments]


def _show_amount(amount: Mapping[str, float], scale: float = 1.0, *, fixed: bool = False) -> str:
    values = [scale * amount[key] for key in ("mean", "p05", "p95")]
    mean, low, high = (f"{value:z.0f}" if fixed else format_number(value) for value in values)
    is_exact = amount["p95"] - amount["p05"] <= (_EXACT_LENGTH if fixed else _EXACT * abs(amount["mean"]))
    return mean if is_exact else f"{mean} ({low} to {high})"
