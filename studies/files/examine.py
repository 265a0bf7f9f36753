"""Examines the import of one robot's file: whether it loads, its messages, its torques, and the choice of a hammer.

Where the import asks for an option, that option is given, as a user who reads the message would do, with the same
numbers for every robot.
"""

import contextlib
import io
import re
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from affordance.cli import main
from affordance.exceptions import AffordanceError
from affordance.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.robots.kept import import_arm
from affordance.robots.reader import read_robot
from affordance.robots.reduced_arm import ReducedArm
from affordance.robots.xacro_file import AS_IT_IS, expand, is_template
from studies.study import import_part

# Values given where the import asks for them: effort, velocity and rotor inertia of an average arm, [N m, rad/s, kg
# m^2].
EFFORT, VELOCITY, ROTOR_INERTIA = 100.0, 3.0, 0.01
_ROUNDS = 6


class Examined(NamedTuple):
    """Findings about one file; a text is empty where it does not apply."""

    file: str
    format: str
    joints: int  # number of joints of the arm; 0 if the file does not load
    options: str  # options that the messages asked for
    refused: str  # last message, if the file does not load
    parity: float | None  # largest relative difference from Pinocchio or MuJoCo; None if it was not measured
    against: str  # program that it was compared with, or why it was not compared
    warnings: tuple[str, ...]
    hammer: str  # first line printed by rank hammer
    import_s: float
    rank_s: float


def examine(path: Path, shown: str) -> Examined:
    """Examines a robot's file; ``shown`` is the name under which it is reported."""
    options, said = ImportOptions(), ""
    arm: ReducedArm | None = None
    for _ in range(_ROUNDS):
        try:
            arm, _ = extract_arm(path, options)
            said = ""
            break
        except AffordanceError as error:
            said = str(error)
            options, former = _follow(said, options), options
            if options == former:
                break
    kind = path.suffix.lstrip(".").lower() if arm is None else arm.tree.description.kind
    kind = "xacro" if path.suffix == ".xacro" else kind
    given = " ".join(_list_given(options))
    nothing = Examined(shown, kind, 0, given, said, None, "", (), "", 0.0, 0.0)
    if arm is None:
        return nothing
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "arm"
        start = time.perf_counter()
        try:
            lines = import_arm(path, options, out, with_meshes=False, fits_tasks=False)
        except AffordanceError as error:
            return nothing._replace(refused=str(error))
        seconds = time.perf_counter() - start
        warnings = tuple(line.removeprefix("warning: ") for line in lines if line.startswith("warning: "))
        start = time.perf_counter()
        hammer = _rank(out)
        ranked = time.perf_counter() - start
        parity, against = _compare(path, arm, options, Path(folder))
    return Examined(shown, kind, len(arm.links), given, "", parity, against, warnings, hammer, seconds, ranked)


def _follow(message: str, options: ImportOptions) -> ImportOptions:
    """Returns the options with those added that a message asks for."""
    listed = message.partition("limbs end in")[2]
    if "--tip: is missing" in message and (ends := re.findall(r"([^\s,(]+) \(\d+ joints", listed)):
        hands = [name for name in ends if "finger" not in name] or ends
        right = [name for name in hands if re.search("right|(^|_|/)r_", name, re.IGNORECASE)]
        options = replace(options, tip=(right or hands)[0])
    if "--effort " in message:
        options = replace(options, effort={"": EFFORT})
    if "--velocity " in message:
        options = replace(options, velocity={"": VELOCITY})
    if "--mend-inertia" in message:
        options = replace(options, mend_inertia=True)
    if "--rotor-inertia " in message:
        options = replace(options, rotor_inertia={"": ROTOR_INERTIA})
    if "--gravcomp none" in message:
        options = replace(options, gravcomp=False)
    if "--damping none" in message:
        options = replace(options, damping=False)
    return options


def _list_given(options: ImportOptions) -> list[str]:
    given = [f"--tip {options.tip}"] if options.tip else []
    given += [f"--effort {EFFORT:g}"] if options.effort else []
    given += [f"--velocity {VELOCITY:g}"] if options.velocity else []
    given += [f"--rotor-inertia {ROTOR_INERTIA:g}"] if options.rotor_inertia else []
    given += ["--mend-inertia"] if options.mend_inertia else []
    given += ["--gravcomp none"] if not options.gravcomp else []
    return [*given, *(["--damping none"] if not options.damping else [])]


def _rank(folder: Path) -> str:
    """Returns the first line that ``affordance rank hammer`` prints for an imported arm."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        main(["rank", "hammer", "--robot", str(folder), "--samples", "2000"])
    lines = (out.getvalue() or err.getvalue()).splitlines()
    return lines[0] if lines else ""


def _compare(path: Path, arm: ReducedArm, options: ImportOptions, folder: Path) -> tuple[float | None, str]:
    """Compares an arm with MuJoCo if the file is in MuJoCo's format, otherwise with Pinocchio; both read the file."""
    if arm.mended:
        return None, f"the inertia of {', '.join(arm.mended)} was mended"
    original = path
    if is_template(path):
        original = folder / "expanded.urdf"
        original.write_bytes(expand(path, AS_IT_IS).content)
    try:
        if read_robot(original).kind == "mjcf":
            part = import_part("studies.files.mujoco_parity")
            return float(
                part.compare_with_mujoco(original, read_arm(path, replace(options, damping=False)))
            ), "MuJoCo"
        part = import_part("studies.arms.parity")
        return float(part.compute_parity(original, replace(options, rotor_inertia={})).largest), "Pinocchio"
    except (AffordanceError, ValueError, IndexError, KeyError, RuntimeError) as error:
        return None, f"not compared: {' '.join(str(error).split())[:120]}"
