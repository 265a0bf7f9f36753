"""``affordance identify`` on generated logs: its output, its files, and its messages for bad input."""

import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.answers import Answer, answer
from helpers.generated_runs import PAYLOAD, Truth, build_robot, generate_run
from helpers.refusals import refuse_command
from helpers.trials import write_known
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

from affordance.commands.demo import ARM_FILE, EMPTY, LOADED, PIECE, STOCK
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.payload.payload_setting import show_number
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import SignalKind
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.reporting import figures

_TOOLS = load_tools(MODELS / "tools" / "novel.yaml")
_STICK = next(tool for tool in _TOOLS if tool.name == "stick")
_QUICK = {"with_meshes": False, "fits_tasks": False}
_TRUTH = Truth(gain=0.1, load_friction=0.05, friction=(1.0, 0.5, 0.2), noise_sd=0.1)


def _write(folder, name: str, run: Run) -> None:
    unit = "current" if run.description.kind is SignalKind.CURRENT else "tau"
    n = run.q.shape[1]
    names = ["time", *(f"{kind}_{i + 1}" for kind in ("q", "v", unit) for i in range(n))]
    rows = np.hstack([run.times[:, None], run.q, run.v, run.signal])
    np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=",".join(names), comments="")
    joints = ", ".join(run.description.joint_names)
    (folder / f"{name}.yaml").write_text(f"joints: [{joints}]\nsignal: {run.description.kind.value}\ntip: flange\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    robot = build_robot(folder)
    rng = np.random.default_rng(11)
    held = {"empty": None, "loaded": PAYLOAD, "heavy": 2.0 * PAYLOAD, "stick": _STICK.parameters}
    held |= {"stick_again": held["stick"], "nothing": None}
    for name, pi in held.items():
        run = generate_run(robot, pi, truth=_TRUTH, rng=rng, kind=SignalKind.CURRENT, rate=50.0)
        _write(folder, name, run)
    return folder


def _run(folder, *words: object, status: int = 0) -> Answer:
    return answer("identify", folder / "robot.urdf", "--samples", 500, *words, status=status)


def _name(folder, *names: str) -> list[Path]:
    return [folder / f"{name}.csv" for name in names]


def test_gains_of_a_weighed_load_serve_the_next_one(folder, tmp_path):
    empty, loaded, heavy = _name(folder, "empty", "loaded", "heavy")
    words = ("--empty", empty, "--loaded", heavy, "--reference-mass", 2.0 * PAYLOAD[0])
    place = tmp_path / "memory.sqlite"
    text = _run(folder, *words, "--out", tmp_path, "--memory", place).out
    assert f"{place} learns nothing: no object seen by a camera was given (--object)" in " ".join(text.split())
    assert not place.exists()
    assert "Mass from each half of the run, with the gains of the other half" in text
    assert "set_target_payload(" in text
    assert "Assumed:" in text
    pictures = ("fit.png", "posteriors.png")
    for name in (*pictures, "samples.npz", "belief.json", "belief.txt", "gains.yaml"):
        assert (tmp_path / name).stat().st_size > 0
    words = ("--empty", empty, "--loaded", loaded, "--gains", tmp_path / "gains.yaml", "--min-speed", 0.05)
    found = _run(folder, *words, "--json").content
    assert abs(found["mass_kg"] - PAYLOAD[0]) < 3.0 * found["mass_sd_kg"]
    assert found["mass_interval90"][0] < PAYLOAD[0] < found["mass_interval90"][1]
    assert len(found["com_m"]) == len(found["com_sd_m"]) == 3
    assert found["mass_sd_kg"] < 0.1
    assert "samples of a joint slower than 0.05 rad/s are left out" in found["assumed"]


def test_an_imported_robot_gives_the_answer_of_its_file(folder, tmp_path):
    """The folder knows the tip of the file, with the same numbers; its hand is the tip, turned."""
    import_arm(folder / "robot.urdf", ImportOptions("flange", out_axis="y", roll=0.0), tmp_path / "six", **_QUICK)
    empty, loaded = _name(folder, "empty", "heavy")
    words = ("--empty", empty, "--loaded", loaded, "--reference-mass", 2.0 * PAYLOAD[0], "--samples", 500, "--json")
    of_file, imported, in_hand = (
        answer("identify", *robot, *words).content
        for robot in (
            [folder / "robot.urdf"],
            ["--robot", tmp_path / "six"],
            [tmp_path / "six", "--tip", "hand_grip"],
        )
    )
    assert (of_file["frame"], imported["frame"], in_hand["frame"]) == ("flange", "flange", "hand_grip")
    assert imported["trusted"] == of_file["trusted"] is True
    for key in ("mass_kg", "com_m", "inertia_kg_m2", "mass_sd_kg", "com_sd_m"):
        assert imported[key] == pytest.approx(of_file[key], rel=1e-6, abs=1e-9)
    x, y, z = of_file["com_m"]
    assert in_hand["com_m"] == pytest.approx([y, z, x], abs=0.2 * max(of_file["com_sd_m"]))


@pytest.mark.parametrize("axis", ["y", "-z"])
def test_an_imported_robot_gives_the_lines_and_the_verdict_of_its_file(folder, tmp_path, axis):
    """A result in the hand, which is turned, has by Drake the lines of the tip of the file."""
    roll = 0.5
    import_arm(folder / "robot.urdf", ImportOptions("flange", out_axis=axis, roll=roll), tmp_path / "six", **_QUICK)
    empty, loaded = _name(folder, "empty", "heavy")
    description, claimed = tmp_path / "tipless.yaml", tmp_path / "set.yaml"
    description.write_text((folder / "empty.yaml").read_text().replace("tip: flange\n", ""))
    x, y, z = PAYLOAD[1:4] / PAYLOAD[0]
    claimed.write_text(f"mass: {2.0 * PAYLOAD[0]}\ncom: [{x}, {y}, {z}]\n")
    words = ["--empty", empty, "--loaded", loaded, "--reference-mass", 2.0 * PAYLOAD[0], "--samples", 4000]
    words += ["--description", description, "--claimed", claimed]
    of_file, imported, in_hand = (
        answer("identify", *robot, *words, "--json").content
        for robot in (
            [folder / "robot.urdf", "--tip", "flange"],
            [tmp_path / "six"],
            [tmp_path / "six", "--tip", "hand_grip"],
        )
    )
    for key in ("frame", "flange", "payload_settings"):
        assert imported[key] == of_file[key]
    for key in ("probability", "plausibility", "torque_error"):
        assert imported["claims"][0][key] == pytest.approx(of_file["claims"][0][key], rel=1e-6)
    assert (in_hand["frame"], in_hand["flange"], in_hand["claims"][0]["frame"]) == ("hand_grip", "flange", "flange")
    assert of_file["claims"][0]["verdict"] == in_hand["claims"][0]["verdict"] == "right"
    # Hx points along the axis, H is rolled about it, and lies at the tip.
    R = RotationMatrix(
        np.eye(3)[:, [1, 2, 0]] if axis == "y" else np.eye(3)[:, [2, 0, 1]] @ np.diag([-1.0, -1.0, 1.0])
    ) @ RotationMatrix.MakeXRotation(roll)
    line = in_hand["payload_settings"]["Drake (Python)"]
    found = eval(line, {"SpatialInertia": SpatialInertia, "RotationalInertia": RotationalInertia})
    expected = R @ np.array(in_hand["com_m"])
    np.testing.assert_allclose(found.get_com(), expected, atol=1e-5)
    assert "# in the frame 'flange'" in line
    np.testing.assert_allclose(expected, of_file["com_m"], atol=0.3 * max(of_file["com_sd_m"]))


def test_moments_of_a_seen_object_are_turned_from_the_hand_to_the_flange(folder, tmp_path):
    """By Drake; a camera's object is posed in the hand, so that the result is too."""
    import_arm(folder / "robot.urdf", ImportOptions("flange", out_axis="-y", roll=0.0), tmp_path / "six", **_QUICK)
    empty, stick = _name(folder, "empty", "stick")
    description = tmp_path / "tipless.yaml"
    R_FH = RotationMatrix(np.eye(3)[:, [1, 2, 0]] @ np.diag([-1.0, -1.0, 1.0]))
    # The stick as it was recorded, at the flange.
    turned = np.rad2deg(RollPitchYaw(R_FH.inverse()).vector()).round(6).tolist()
    text = (folder / "empty.yaml").read_text().replace("tip: flange\n", "")
    description.write_text(f"{text}object_pose: {{position: [0, 0, 0], rpy_deg: {turned}}}\n")
    words = ["--empty", empty, "--loaded", stick, "--description", description, "--samples", 2000]
    words += ["--object", MODELS / "tools" / "novel.yaml", "--object-name", "stick", "--unseen", ".05"]
    known = {"beech": 720.0, "steel": 7850.0}  # so that the moments are seen
    words += ["--memory", write_known(tmp_path / "known.sqlite", known, things=3)]
    found = answer("identify", tmp_path / "six", *words, "--json").content
    assert (found["frame"], found["flange"]) == ("hand_grip", "flange")
    # What a controller subtracts is posed as a controller has it, so that the frame must be named.
    description.write_text(description.read_text() + "compensated_payload: {mass: 0.2, com: [0, 0, 0.1]}\n")
    said = answer("identify", tmp_path / "six", *words, status=2).err
    assert "compensated_payload: is in the frame of the controller's tip, so --tip must" in said
    inertia = RotationalInertia(*found["inertia_kg_m2"]).ReExpress(R_FH)
    line = found["payload_settings"]["Universal Robots (URScript)"].split("#")[0]
    numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", line)]
    assert numbers[4:10] == pytest.approx([*inertia.get_moments(), *inertia.get_products()], rel=1e-4, abs=1e-9)
    assert numbers[1:4] == pytest.approx(R_FH @ np.array(found["com_m"]), abs=1e-5)


def test_lines_and_claims_are_left_out_where_the_flange_is_not_known(folder, tmp_path):
    """A folder of version 0.2 has the hand only, and the paper's arm has no controller."""
    import_arm(folder / "robot.urdf", ImportOptions("flange", out_axis="y"), tmp_path / "six", **_QUICK)
    sdf = tmp_path / "six" / "arm.sdf"
    sdf.write_text(re.sub(r'<frame name="flange".*?</frame>', "", sdf.read_text(), flags=re.DOTALL))
    empty, loaded = _name(folder, "empty", "heavy")
    description, claimed = tmp_path / "tipless.yaml", tmp_path / "set.yaml"
    description.write_text((folder / "empty.yaml").read_text().replace("tip: flange\n", ""))
    claimed.write_text("mass: 0.55\ncom: [0.1, 0, 0]\n")
    old = [tmp_path / "six", "--description", description, "--empty", empty, "--loaded", loaded]
    old += ["--reference-mass", 2.0 * PAYLOAD[0], "--samples", 500]
    ours = [ARM_FILE, "--empty", EMPTY, "--loaded", LOADED, "--samples", 500]
    for words, reason in (
        (old, "six does not contain the name of the tip in the robot's file: import it again, or use --flange"),
        (ours, "controllers do not know hand_grip, our hand frame (name one"),
    ):
        text = answer("identify", *words).out
        assert "For the robot: no lines, because " in text
        assert reason in text
        assert "set_target_payload(" not in text
        said = answer("identify", *words, "--claimed", claimed, status=2).err
        assert "--claimed: must be in the frame of the flange, but " in said
        assert reason in said
    found = answer("identify", *ours, "--json").content
    assert found["flange"] is None
    assert "payload_settings" not in found
    text = answer("identify", "--demo", "--samples", 500, "--claimed", claimed).out
    assert "For the robot, with hand_grip as its flange" in text
    assert "set, in the frame hand_grip: 0.550 kg at (0.1000, 0.0000, 0.0000) m" in text


def test_the_frame_of_a_wrist_sensor_is_no_flange(folder, tmp_path):
    robot, rng = load_robot(folder / "robot.urdf", "flange"), np.random.default_rng(3)
    run = generate_run(robot, PAYLOAD, truth=Truth(noise_sd=0.1), rng=rng, kind=SignalKind.WRENCH, rate=50.0)
    names = ["time", *(f"q_{i + 1}" for i in range(6)), "fx", "fy", "fz", "tx", "ty", "tz"]
    rows = np.hstack([run.times[:, None], run.q, run.signal])
    np.savetxt(tmp_path / "held.csv", rows, delimiter=",", header=",".join(names), comments="")
    text = (folder / "empty.yaml").read_text().replace("signal: current", "signal: wrench")
    (tmp_path / "held.yaml").write_text(text)
    words = ["--loaded", tmp_path / "held.csv"]
    text = _run(folder, *words).out
    assert "no lines, because a controller accepts no payload in the sensor frame flange (name" in text
    lines = _run(folder, *words, "--flange", "link_6").out
    found = _run(folder, *words, "--json").content
    centre = ", ".join(show_number(value, 5) for value in found["com_m"] + np.array([0.08, 0.0, 0.0]))
    assert f"set_target_payload({found['mass_kg']:.4f}, [{centre}]" in lines


def test_an_object_may_be_described_by_its_own_urdf(folder, tmp_path):
    empty, loaded = _name(folder, "empty", "stick")
    path = tmp_path / "rod.urdf"
    path.write_text(
        '<robot name="rod"><link name="rod"><inertial><mass value="1"/>'
        '<inertia ixx=".0003" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial><visual>'
        '<origin xyz=".15 0 0"/><geometry><box size=".3 .04 .04"/></geometry></visual></link></robot>'
    )
    assert " kg +- " in _run(folder, "--empty", empty, "--loaded", loaded, "--object", path).out


def test_a_seen_object_teaches_a_memory_once(folder, tmp_path):
    empty, loaded, again = _name(folder, "empty", "stick", "stick_again")
    tools, memory = MODELS / "tools" / "novel.yaml", tmp_path / "memory.sqlite"
    words = ["--empty", empty, "--object", tools, "--object-name", "stick", "--memory", memory]
    assert len(_run(folder, *words, "--loaded", loaded, "--json").content["densities_kg_m3"]) == 2
    with open_memory(memory) as ledger:
        before = ledger.recall().belief
    text = _run(folder, *words, "--loaded", loaded).out
    assert "learns nothing: it already contains this run" in text
    assert "kg/m^3, 90 % interval" in text
    with open_memory(memory) as ledger:
        assert len(ledger) == 1
        assert np.array_equal(ledger.recall().belief.precision, before.precision)
    renamed = tmp_path / "\u202eagain.csv"
    for suffix in (".csv", ".yaml"):
        shutil.copy(Path(again).with_suffix(suffix), renamed.with_suffix(suffix))
    assert "has learned them" in _run(folder, *words, "--loaded", renamed).out
    with open_memory(memory) as ledger:
        trials = ledger.list_trials()
        assert {(each.robot, each.fingerprint) for each in trials} == {
            ("robot-flange", load_robot(folder / "robot.urdf", "flange").fingerprint)
        }
        assert [each.source for each in trials[1:]] == ["\ufffdagain.csv"]
        assert len(ledger) == 2
        assert [list(each.names) for each in ledger.review().things] == [[ledger.list_trials()[0].object_name]]
        # A thing's deviation from its materials counts once: of two runs hardly more is known of these than of one.
        sds = np.sqrt(np.diag(ledger.recall().belief.covariance))
        assert (sds < np.sqrt(np.diag(before.covariance))).all()
        assert ledger.verify() == []
        ledger.append([replace(trials[0], fingerprint="of another", source_hash="of another")])
    past = "robot-flange had another arm in 1 of its trials, which still count for materials"
    assert past in _run(folder, *words, "--loaded", again).out


def test_an_object_that_is_another_teaches_nothing(folder, tmp_path):
    """A weighed load whose centre of mass is in no stick leaves no memory, and is identified without the camera."""
    empty, loaded = _name(folder, "empty", "heavy")
    tools, memory = MODELS / "tools" / "novel.yaml", tmp_path / "memory.sqlite"
    words = ["--empty", empty, "--loaded", loaded, "--object", tools, "--object-name", "stick"]
    text = _run(folder, *words, "--reference-mass", 2.0 * PAYLOAD[0], "--memory", memory, status=0).out
    assert not memory.exists()
    assert "the camera is ignored" in text
    assert "the object is not what it looks like (p = " in text
    found = _run(folder, *words[:4], "--reference-mass", 2.0 * PAYLOAD[0], "--json").content
    assert f"{found['com_m'][2]:.3g}"[:4] in text


def test_arm_and_materials_are_those_of_other_commands(tmp_path):
    """Without a robot the arm is the paper's; the materials of a robot's folder name what is seen."""
    words = ["--empty", EMPTY, "--loaded", LOADED, "--object", STOCK, "--object-name", PIECE]
    words += ["--samples", 500, "--json"]
    named = answer("identify", *words).content
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "materials.yaml"
    own = answer("identify", "--robot", tmp_path / "models", *words).content
    assert own["mass_kg"] == named["mass_kg"]
    path.write_text(path.read_text().replace("oak:", "red_oak:"))
    assert "red_oak" in answer("identify", "--robot", tmp_path / "models", *words, status=2).err


def test_the_name_of_an_object_wants_one(folder):
    (loaded,) = _name(folder, "loaded")
    said = answer("identify", folder / "robot.urdf", "--loaded", loaded, "--object-name", "stick", status=2).err
    assert "--object-name: describes a seen object, must be given with --object" in said


def test_a_result_that_is_not_to_be_trusted_says_so_first_and_leaves_nothing_behind(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "save_figure", lambda *arguments: None)  # drawn by the test above
    empty, loaded = _name(folder, "empty", "heavy")
    swapped = ("--empty", loaded, "--loaded", empty, "--reference-mass", 2.0 * PAYLOAD[0], "--out")
    text = _run(folder, *swapped, tmp_path / "a", status=3).out
    assert text.splitlines()[0].endswith(" mm in flange: NOT TO BE TRUSTED")
    assert text.splitlines()[2] == "NOT TO BE TRUSTED:"
    assert "set_target_payload(" not in text
    assert not (tmp_path / "a" / "gains.yaml").exists()
    assert json.loads((tmp_path / "a" / "belief.json").read_text())["trusted"] is False
    text = _run(folder, *swapped, tmp_path / "b", "--anyway", status=3).out
    assert "as its flange (--flange names another frame), NOT TO BE TRUSTED:" in text
    assert (tmp_path / "b" / "gains.yaml").exists()


def test_a_mass_that_was_not_seen_is_said_first_with_what_would_show_it(folder, tmp_path):
    """Without an empty run the mass is hardly known; with one, an empty hand is known to hold next to nothing."""
    loaded, empty, nothing, heavy = _name(folder, "loaded", "empty", "nothing", "heavy")
    text = _run(folder, "--loaded", loaded, status=3).out
    assert text.splitlines()[2].startswith("NOT SEEN: the mass (90 % interval ")
    assert text.splitlines()[3].startswith("  to see it: record the same motion with an empty hand (--empty)")
    assert "No reason was found" not in text
    assert "no lines, because the mass was not seen" in text
    found = _run(folder, "--loaded", loaded, "--json", status=3).content
    assert found["trusted"] is True
    assert found["mass_seen"] is False
    assert "(--empty)" in found["would_show_mass"]
    _run(folder, "--empty", empty, "--loaded", heavy, "--reference-mass", 2.0 * PAYLOAD[0], "--out", tmp_path)
    words = ("--empty", empty, "--loaded", nothing, "--gains", tmp_path / "gains.yaml")
    text = _run(folder, *words).out
    assert text.splitlines()[0].startswith("Little or nothing is held, 0.0")
    assert text.splitlines()[2] == "No reason to distrust the result was found."
    assert "mass (mass): little or nothing is held" in text
    assert "no lines, because little or nothing is held" in text
    assert _run(folder, *words, "--json").content["mass_seen"] is True


def test_payloads_of_the_controller_are_compared(folder, tmp_path):
    empty, heavy = _name(folder, "empty", "heavy")
    x, y, z = PAYLOAD[1:4] / PAYLOAD[0]
    right, wrong = tmp_path / "right.yaml", tmp_path / "wrong.yaml"
    right.write_text(f"mass: {2 * PAYLOAD[0]}\ncom: [{x}, {y}, {z}]\ninertia: [1.0e-4, 1.0e-4, 1.0e-4]\n")
    wrong.write_text("mass: 0.73\ncom: [0, 0, 0.06]\n")
    words = ("--empty", empty, "--loaded", heavy, "--reference-mass", 2.0 * PAYLOAD[0], "--claimed", wrong, right)
    answered = _run(folder, *words, "--out", tmp_path / "out").out
    text = " ".join(answered.split())
    assert f"Claimed: the payload of {wrong} is wrong (right with probability 0.00" in text
    assert f"Claimed: the payload of {right} is right (" in text
    assert "its moments were not compared, as the run cannot check them" in text
    assert answered.index("Claimed:") < answered.index("Assumed:") < answered.index("set_target_payload(")
    claims = json.loads((tmp_path / "out" / "belief.json").read_text())["claims"]
    assert [(each["file"], each["verdict"], each["moments_compared"]) for each in claims] == [
        (str(wrong), "wrong", None),
        (str(right), "right", False),
    ]


def test_libraries_that_take_long_to_import_are_left_out(children):
    """Libraries that take longer to import than identification takes are not imported."""
    slow = {"cv2", "jinja2", "joblib", "matplotlib", "xarray"}
    slow |= {f"scipy.{name}" for name in ("interpolate", "optimize", "signal", "spatial", "stats")}
    program = "import sys, affordance.commands.payload.identify; print(*sys.modules)"
    out, _ = children([sys.executable, "-c", program]).communicate()
    assert "scipy.linalg" in out.split()
    assert not slow & set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--reference-mass -1", "--reference-mass: is -1.0, must be from 0.001 to 1000 kg"),
        ("--robot nowhere", "--robot: is given 2 times, must be given once"),
        ("--samples 5", "--samples: is 5, must be from 100 to 100000"),
        ("--min-speed -1", "--min-speed: is -1.0, must be from 0 to 10 rad/s"),
        ("--tip hand_grp", "--tip: is 'hand_grp', which is not in arm.dmd.yaml; nearest: hand_grip"),
        ("--gains nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("--object nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("--object-name brush --object novel.yaml", "--object-name: is 'brush', must be"),
        ("--memory nowhere/memory.sqlite", "memory.sqlite: cannot be created: there is no folder"),
        (
            "--set mpc.horizon=1",
            "--set: mpc.horizon: has no effect here: a seen object uses only the prior's settings",
        ),
    ],
)
def test_mistake_is_refused_before_anything_is_written(tmp_path, monkeypatch, words, said):
    for name in ("arm.dmd.yaml", "arm.sdf", "package.xml", "tools/novel.yaml"):
        shutil.copy(MODELS / name, tmp_path)
    shutil.copytree(MODELS / "demo", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("identify", "arm.dmd.yaml", "--loaded", "bar_of_oak.csv", *words.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("robot.urdf", "--loaded: is missing, must be a recording with the load; or give --demo"),
        ("robot.urdf --demo", "--demo: uses its own data, must be given without a robot"),
        ("--demo --tip flange", "--demo: uses its own data, must be given without --tip"),
        ("robot.urdf --loaded run.csv", "--tip: is missing, must be given here or in the run's description"),
    ],
)
def test_robot_recording_and_tip_must_be_given(tmp_path, monkeypatch, words, said):
    robot = build_robot(tmp_path)
    _write(tmp_path, "run", generate_run(robot, None, truth=_TRUTH, rng=np.random.default_rng(1), duration=1.0))
    (tmp_path / "run.yaml").write_text(f"joints: [{', '.join(robot.joint_names)}]\n")
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("identify", *words.split())


@pytest.mark.parametrize("option", ["tip", "base"])
def test_a_frame_that_the_description_names_is_refused_in_its_name(tmp_path, monkeypatch, option):
    """The user gave no such option, so the message must not blame one."""
    robot = build_robot(tmp_path)
    _write(tmp_path, "run", generate_run(robot, None, truth=_TRUTH, rng=np.random.default_rng(1), duration=1.0))
    names = {"tip": "flange"} | {option: "gone"}
    lines = [
        f"joints: [{', '.join(robot.joint_names)}]",
        "signal: joint_torque",
        *(f"{k}: {v}" for k, v in names.items()),
    ]
    (tmp_path / "run.yaml").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    said = refuse_command("identify", "robot.urdf", "--loaded", "run.csv")
    assert f"run.csv: {option} in its description: is 'gone', which is not in robot.urdf" in said


def test_the_answer_in_json_is_whole_on_a_narrow_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    assert answer("identify", "--demo", "--samples", 500, "--json").content["answer"].endswith(": trusted")
