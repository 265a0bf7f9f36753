"""``affordance see``: measures an object in your colour and depth picture, and writes it as a tools file."""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arguments import check_number
from affordance.commands import answers
from affordance.commands.demo import check_alone
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError, SeeingError, describe_choice
from affordance.extensions.pixels.photographs.camera import read_camera
from affordance.extensions.pixels.photographs.contents import MATERIALS_BY_KIND, UNKNOWN
from affordance.extensions.pixels.photographs.example import CANS, write_examples
from affordance.extensions.pixels.photographs.pictures import USUAL_UNIT, read_colour, read_depth, read_mask
from affordance.extensions.pixels.photographs.see import SeenObject, see
from affordance.extensions.pixels.photographs.seen_picture import write_seen
from affordance.objects.load import load_tools
from affordance.objects.materials import Material, load_materials
from affordance.objects.tool import Tool
from affordance.reporting.formatting import break_line

# Exit status if the result is doubtful and no outline was given. Then seen.png is written, but no tools file.
_DOUBTED = 3
_HALF90 = 1.645
_NAMES_OF_PARTS = 2


def run(arguments: argparse.Namespace) -> int:
    """Measures an object, prints and writes it. The exit status is 0, or 3 if an outline is required."""
    if arguments.demo is not None:
        return _write_demo(arguments)
    for name in ("colour", "depth", "camera"):
        if getattr(arguments, name) is None:
            shown = name.upper() if name == "colour" else f"--{name}"
            hint = "without intrinsics a size cannot be measured" if name == "camera" else "see --help, or --demo DIR"
            raise BadValueError(shown, "", f"is missing: {hint}")
    materials = load_materials()
    names = _choose_materials(arguments, materials)
    colour = read_colour(arguments.colour)
    height, width = colour.shape[:2]
    size = (width, height)
    camera = read_camera(arguments.camera, size, arguments.colour.name, is_cropped=arguments.cropped)
    unit = arguments.depth_unit
    if unit is not None:
        check_number("--depth-unit", unit, 1e-6, 1.0, "m")
    unit = unit or camera.depth_unit or USUAL_UNIT
    depth = read_depth(arguments.depth, size, unit)
    mask = None if arguments.mask is None else read_mask(arguments.mask, size)
    if arguments.at is not None:
        if mask is not None:
            raise BadValueError("--at", "", "is given together with --mask, must be given alone")
        for value, most in zip(arguments.at, size, strict=True):
            check_number("--at", value, 0.0, most - 1.0, "pixels")
    at = None if arguments.at is None else (arguments.at[0], arguments.at[1])
    shown_as = load_tools(arguments.same_colour)[0] if arguments.same_colour else None
    try:
        seen = see(colour, depth, camera, at=at, mask=mask, seed=arguments.seed)
    except SeeingError as error:
        raise BadValueError(arguments.colour, "", error.reason) from error
    if shown_as is not None:
        colours = [part.looks_like.colour for part in shown_as.components]
        parts = (replace(part, colour=colours[i % len(colours)]) for i, part in enumerate(seen.parts))
        seen = replace(seen, parts=tuple(parts))
    out = arguments.out or Path(arguments.colour.stem)
    write_seen(out / "seen.png", seen, colour)
    is_used = seen.is_good_fit or mask is not None
    written = seen.write(out, arguments.name or arguments.colour.stem, names) if is_used else None
    content = _build_content(seen, out, written, names, unit)
    content["chosen"] = "mask" if mask is not None else "pixel" if at is not None else "nearest to the middle"
    lines = _describe(content)
    width = find_width()
    answers.print_answer(arguments, "\n".join(part for line in lines for part in break_line(line, width)), content)
    return 0 if is_used else _DOUBTED


def _write_demo(arguments: argparse.Namespace) -> int:
    names = {"colour": "COLOUR", "depth": "--depth", "camera": "--camera", "mask": "--mask"}
    check_alone(arguments, names)
    folder = arguments.demo
    if folder.exists():
        raise BadValueError(folder, "", "exists already, must be a new folder")
    paths = write_examples(folder)
    (first, *_), masses = paths, ", ".join(f"{name} {mass:g} kg" for name, (*_, mass) in CANS.items())
    command = f"affordance see {first} --depth {first.with_name(f'{first.stem}_depth.png')}"
    lines = [
        f"{folder}: ray-cast pictures {', '.join(path.name for path in paths)}, each with its depth, and camera.json",
        f"true masses: {masses}; begin with",
        f"{command} --camera {folder / 'camera.json'}",
    ]
    content = {"pictures": [str(path) for path in paths], "masses": {name: mass for name, (*_, mass) in CANS.items()}}
    answers.print_answer(arguments, "\n".join(lines), content)
    return 0


def _choose_materials(arguments: argparse.Namespace, materials: dict[str, Material]) -> tuple[str, ...]:
    """Returns the names of the parts' materials: one for all parts, or two."""
    if arguments.material is None:
        return (MATERIALS_BY_KIND[arguments.holds] if arguments.holds else UNKNOWN,)
    if arguments.holds is not None:
        raise BadValueError("--holds", "", "is given together with --material, which is for solid objects")
    names = tuple(name.strip() for name in arguments.material.split(","))
    for name in names:
        if name not in materials:
            raise BadValueError("--material", "", describe_choice(name, materials))
    if len(names) > _NAMES_OF_PARTS:
        raise BadValueError("--material", "", f"has {len(names)} names, must have one, or one for each of two parts")
    return names


def _build_content(
    seen: SeenObject, out: Path, written: Path | None, names: tuple[str, ...], unit: float
) -> dict[str, Any]:
    factor = float(np.exp(_HALF90 * seen.volume_sd))
    content: dict[str, Any] = {
        "length": seen.length,
        "distance": float(np.linalg.norm(seen.X_CW[:3, 3])),
        "volume": {"median": seen.volume, "p05": seen.volume / factor, "p95": seen.volume * factor},
        "place_sd": max(part.place_sd for part in seen.parts),
        "misfit": seen.misfit,
        "readings": int(seen.mask.sum()),
        "depth_unit": unit,
        "parts": [
            {"size": (2.0 * part.solid.semi_axes).tolist(), "volume": part.solid.volume, "volume_sd": part.volume_sd}
            for part in seen.parts
        ],
        "doubts": list(seen.doubts),
        "picture": str(out / "seen.png"),
        "tools": None if written is None else str(written),
        "mass": None,
    }
    if written is not None:
        (tool,) = load_tools(written)
        content["mass"] = _expect_mass(tool)
        content["materials"] = list(dict.fromkeys(part.material.name for part in tool.components))
    return content


def _expect_mass(tool: Tool) -> dict[str, float]:
    """Computes the mean and the 90 % interval of the mass, as ``affordance guess`` does."""
    # Imported here, because measuring a picture needs neither advice nor Drake.
    from affordance.belief.material_memory import MaterialMemory
    from affordance.extensions.advice.expected_inertia import expect
    from affordance.extensions.advice.known_materials import know_by_name
    from affordance.settings import DEFAULT_SETTINGS

    prior = DEFAULT_SETTINGS.prior
    known = know_by_name(MaterialMemory(DEFAULT_SETTINGS.learner), [tool], load_materials(), prior)
    return expect(tool, known.memory).whole.mass._asdict()


def _describe(content: dict[str, Any]) -> Iterator[str]:
    """Describes the answer, one line at a time. The first line is the main result."""
    volume, litres = content["volume"], 1e3
    form = "one solid" if len(content["parts"]) == 1 else "two solids along its longest axis"
    sizes = " and ".join(
        " x ".join(f"{100 * x:.1f}" for x in sorted(part["size"], reverse=True)) for part in content["parts"]
    )
    measured = (
        f"{litres * volume['median']:.2f} litres ({litres * volume['p05']:.2f} to {litres * volume['p95']:.2f})"
    )
    if content["mass"]:
        mass, of = content["mass"], ", ".join(name.replace("_", " ") for name in content["materials"])
        yield f"{mass['mean']:.2g} kg ({mass['p05']:.2g} to {mass['p95']:.2g}), assumed: {of}"
    yield f"{form}, {sizes} cm: {measured}, centre +- {1e3 * content['place_sd']:.0f} mm (intervals of 90 %)"
    yield f"It is {content['distance']:.2f} m from the camera; if not, --depth-unit or --camera is wrong."
    if content["chosen"] == "nearest to the middle":
        yield "The object nearest to the middle was measured; --at U V chooses another."
    yield from (f"DOUBTED: {doubt}" for doubt in content["doubts"])
    if content["tools"]:
        yield f"{content['tools']}: for guess, rank, next and memory weigh; look at {content['picture']} first"
    else:
        yield f"No tools file is written; look at {content['picture']}, and give the object's outline with --mask"
