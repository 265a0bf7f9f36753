"""``affordance study pictures``: accuracy of volumes, positions and masses of objects in images.

Images are real or ray-cast. The five real images are not test data: the method and its constants were developed with
them. Ray-cast scenes were generated after the method was final.
"""

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.options import add_weighings
from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.exceptions import SeeingError
from affordance.extensions.advice.known_materials import know_by_name, learn_weighings
from affordance.extensions.pixels.photographs.contents import MATERIALS_BY_KIND, UNKNOWN
from affordance.extensions.pixels.photographs.see import see
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool, Weighing
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.prediction import measure_geometry
from studies.pictures.photographs import Reading, check_data, read_all
from studies.pictures.scenes import draw_scene
from studies.study import Findings, Study, Work, format_table, run_kept

_HALF90, _HALF50 = 1.645, 0.6745
_NUM_SAMPLES = 4000
# Constant guess as a baseline, near the median mass of the objects, [kg].
_CONSTANT = 0.18
_WEIGHING_SD = 0.01  # relative standard deviation of a scale


@dataclass(frozen=True)
class PicturesConfig:
    """Configuration of the study."""

    seed: int = 0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    what = "clone of github.com/yuxng/PoseCNN, whose five pictures are measured too (default: ray-cast scenes only)"
    parser.add_argument("--data", type=Path, metavar="DIR", help=what)
    add_repeats(parser, 100, "ray-cast scenes")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the measurement of scenes and photographs."""
    data = None if arguments.data is None else check_data(arguments.data)
    return partial(_measure, arguments, data)


def run_scene(config: PicturesConfig, repeat: int) -> Mapping[str, NDArray[Any]]:
    """Measures the object in a ray-cast scene.

    Returns: Errors of log volume and position with their stated SDs; NaN if the image is rejected.
    """
    scene = draw_scene(config.seed, repeat)
    kind = np.array(repeat % 3)
    try:
        seen = see(scene.picture.colour, scene.picture.depth, scene.camera, at=scene.at)
    except SeeingError:
        nothing, no = np.array(np.nan), np.array(False)
        place = np.full(3, np.nan)
        return {
            **{"log_ratio": nothing, "log_sd": nothing, "place": place, "place_sd": nothing},
            **{"good": no, "parts": np.array(0), "kind": kind},
        }
    volumes = [part.solid.volume for part in seen.parts]
    middle = np.average([part.solid.X_WS[:3, 3] for part in seen.parts], axis=0, weights=volumes)
    centre = seen.X_CW[:3, :3] @ middle + seen.X_CW[:3, 3]
    return {
        "log_ratio": np.array(np.log(seen.volume / scene.volume)),
        "log_sd": np.array(seen.volume_sd),
        "place": seen.X_CW[:3, :3].T @ (centre - scene.centre),
        "place_sd": np.array(max(part.place_sd for part in seen.parts)),
        "good": np.array(seen.is_good_fit),
        "parts": np.array(len(seen.parts)),
        "kind": kind,
    }


def _measure(arguments: argparse.Namespace, data: Path | None, folder: Path) -> Iterator[Findings]:
    config = PicturesConfig(arguments.seed)
    found = run_kept(
        config, run_scene, folder, [], repeats=arguments.repeats, jobs=arguments.jobs, description="pictures: scenes"
    )
    numbers: dict[str, Any] = {"seed": arguments.seed, "scenes": tabulate_scenes(found)}
    yield Findings(numbers)
    if data is not None:
        readings = list(read_all(data, folder))
        numbers["photographs"] = tabulate_readings(readings)
        numbers["masses"] = tabulate_masses(readings)
        yield Findings(numbers)
        print(
            "No blind test: the method was developed with these five pictures, and words were chosen by someone who"
        )
        print("knew the masses. The things in the pictures were never weighed: masses are those of other specimens.")


def tabulate_scenes(found: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Prints and returns a summary of ray-cast scenes."""
    rows, numbers = [], dict[str, Any]()
    groups = {"all": np.ones(len(found["kind"]), dtype=bool)}
    groups |= {name: found["kind"] == k for k, name in enumerate(("box", "cylinder", "superquadric"))}
    is_seen = found["parts"] > 0
    for name, chosen in groups.items():
        own = chosen & is_seen
        if not own.any():
            continue
        error, sd = found["log_ratio"][own], found["log_sd"][own]
        place, place_sd = found["place"][own], found["place_sd"][own, None]
        numbers[name] = {
            "scenes": int(chosen.sum()),
            "refused": int((chosen & ~is_seen).sum()),
            "median_volume_error": float(np.median(np.abs(np.expm1(error)))),
            "volume_inside": [float(np.mean(np.abs(error) < half * sd)) for half in (_HALF50, _HALF90)],
            "median_place_m": float(np.median(np.linalg.norm(place, axis=1))),
            "place_inside": [float(np.mean(np.abs(place) < half * place_sd)) for half in (_HALF50, _HALF90)],
            "doubted": float(np.mean(~found["good"][own])),
            "two_parts": float(np.mean(found["parts"][own] > 1)),
        }
        n = numbers[name]
        rows.append(
            [
                name,
                f"{n['scenes']}, {n['refused']}",
                f"{100 * n['median_volume_error']:.0f} %",
                _show_shares(n["volume_inside"]),
                f"{1e3 * n['median_place_m']:.1f} mm",
                _show_shares(n["place_inside"]),
                f"{100 * n['doubted']:.0f} %",
                f"{100 * n['two_parts']:.0f} %",
            ]
        )
    header = [
        "ray-cast",
        "scenes, refused",
        "volume error",
        "in 50, 90 %",
        "centre error",
        "in 50, 90 %",
        "doubted",
        "two parts",
    ]
    print(f"{format_table(header, rows)}\n", flush=True)
    return numbers


def tabulate_readings(readings: Sequence[Reading]) -> dict[str, Any]:
    """Prints and returns measured and true volumes of all objects in photographs."""
    rows, numbers = [], dict[str, Any]()
    for each in readings:
        seen = each.seen
        error = float(np.log(seen.volume / each.volume))
        numbers[f"{each.picture} {each.name}"] = {
            "volume_ratio": float(np.exp(error)),
            "volume_sd": seen.volume_sd,
            "misfit": seen.misfit,
            "parts": len(seen.parts),
        }
        inside = "inside" if abs(error) < _HALF90 * seen.volume_sd else "OUTSIDE"
        cells = [f"{1e3 * each.volume:.2f}", f"{np.exp(error):.2f}", f"{seen.volume_sd:.2f}", f"{seen.misfit:.1f}"]
        rows.append([each.picture[-1], each.name[4:].replace("_", " "), *cells, str(len(seen.parts)), inside])
    header = ["picture", "object", "true litres", "measured / true", "SD of ln", "misfit", "parts", "90 %"]
    print(f"{format_table(header, rows)}\n", flush=True)
    errors = np.array([np.log(each.seen.volume / each.volume) for each in readings])
    sds = np.array([each.seen.volume_sd for each in readings])
    numbers["inside"] = [float(np.mean(np.abs(errors) < half * sds)) for half in (_HALF50, _HALF90)]
    numbers["median_error"] = float(np.median(np.abs(np.expm1(errors))))
    shares = _show_shares(numbers["inside"])
    print(f"volumes inside 50, 90 %: {shares}; median error {100 * numbers['median_error']:.0f} %\n", flush=True)
    return numbers


def tabulate_masses(readings: Sequence[Reading]) -> dict[str, Any]:
    """Prints and returns the accuracy of predicted masses, by prior knowledge."""
    pairs = [(a, b) for a in readings for b in readings if a.name == b.name and a.picture != b.picture]
    told = [each for each in readings if each.kind is not None]
    states = {
        "any material": [(draw_masses(each, UNKNOWN, knows=False), each.mass) for each in readings],
        "household thing": [(draw_masses(each, UNKNOWN), each.mass) for each in readings],
        "one word": [(draw_masses(each, MATERIALS_BY_KIND[each.kind or ""]), each.mass) for each in told],
        "weighed once, in another picture": [
            (draw_masses(other, UNKNOWN, weighed=first), other.mass) for first, other in pairs
        ],
        "constant guess, 0.18 kg": [(np.full(1, _CONSTANT), each.mass) for each in readings],
    }
    rows, numbers = [], dict[str, Any]()
    for name, found in states.items():
        guesses = np.array([np.median(masses) for masses, _ in found])
        truth = np.array([mass for _, mass in found])
        ends = np.array([np.quantile(masses, [0.25, 0.75, 0.05, 0.95]) for masses, _ in found])
        ratio = np.log(guesses / truth)
        inside = [float(np.mean((ends[:, k] < truth) & (truth < ends[:, k + 1]))) for k in (0, 2)]
        numbers[name] = {
            "readings": len(found),
            "min_ratio_error": float(np.exp(-np.abs(ratio)).mean()),
            "abs_log_difference": float(np.abs(ratio).mean()),
            "inside": inside,
            "half_width": float(np.median(np.sqrt(ends[:, 3] / np.maximum(ends[:, 2], 1e-6)))),
        }
        n, is_constant = numbers[name], len(found[0][0]) == 1
        spread = ["-", "-"] if is_constant else [_show_shares(inside), f"x/÷ {n['half_width']:.1f}"]
        cells = [str(len(found)), f"{n['min_ratio_error']:.2f}", f"{n['abs_log_difference']:.2f}", *spread]
        rows.append([name, *cells])
    header = ["known", "readings", "MnRE", "ALDE", "in 50, 90 %", "half of the 90 % interval"]
    print(f"{format_table(header, rows)}\n", flush=True)
    return numbers


def draw_masses(reading: Reading, material: str, *, knows: bool = True, weighed: Reading | None = None) -> Array:
    """Draws masses of an object, [kg], from the belief that the commands compute for its tools file.

    Args:
        reading: Object in an image.
        material: Material of its parts.
        knows: True for the handbook density of the material, False for the prior of an unknown material.
        weighed: Same object in another image in which it was weighed; None if it was not weighed.
    """
    prior, materials = DEFAULT_SETTINGS.prior, load_materials()
    tool = _build_tool(reading, material)
    names: list[str] | None = None if knows else []
    memory = know_by_name(MaterialMemory(DEFAULT_SETTINGS.learner), [tool], materials, prior, names).memory
    if weighed is not None:
        colours = [part.looks_like for part in tool.components]
        first = _build_tool(weighed, material, Weighing((), weighed.mass, _WEIGHING_SD * weighed.mass))
        same = [replace(part, looks_like=colours[k % len(colours)]) for k, part in enumerate(first.components)]
        first = Tool(first.name, tuple(same), first.grips, weighings=first.weighings)
        options = {"first": add_weighings(list_drawn_options([first]), [first])[0]}
        memory = learn_weighings(memory, options, prior)
    seen = measure_drawing(tool)
    recalled = memory.recall([part.appearance for part in seen], prior)
    rng = np.random.default_rng(0)
    rho = recalled.densities.draw_samples(rng, _NUM_SAMPLES)[:, list(recalled.columns)]
    geometry = measure_geometry(seen, range(len(seen)), len(seen))
    errors = rng.standard_normal((_NUM_SAMPLES, len(geometry.Phi_errors)))
    return geometry.compute_parameters(rho, errors)[:, 0]


def _build_tool(reading: Reading, material: str, *weighings: Weighing) -> Tool:
    with tempfile.TemporaryDirectory() as folder:
        (tool,) = load_tools(reading.seen.write(Path(folder), reading.name, (material,)))
        # Meshes must be read before the folder is deleted.
        return Tool(tool.name, tool.components, tool.grips, weighings=weighings)


def _show_shares(shares: Sequence[float]) -> str:
    return " ".join(f"{share:.2f}" for share in shares)


STUDY = Study("volumes and masses of objects in ray-cast and real pictures, with coverage", add_arguments, plan)
