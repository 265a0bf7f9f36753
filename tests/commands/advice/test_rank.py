"""Ranking of tools and grips: table, reasons, sentence, JSON and picture, and one line for bad input."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.robot_files import write_urdf
from helpers.trials import hold, write_known
from helpers.workshop import HAMMERS

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import load_hammer
from affordance.choice.listed_options import list_options
from affordance.choice.pricing import GRIP_LEVER
from affordance.choice.ranking import rank
from affordance.commands import options, run
from affordance.commands.advice import workbench
from affordance.commands.watch import watch
from affordance.exceptions import AffordanceError
from affordance.extensions.advice import advice_figure
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.pixels import seen_tool
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_arm
from affordance.files.lacks import write_lacks
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm_model import ArmModel
from affordance.robot import Robot

PAST = "the paper's arm had another arm in 1 of its trials, which still count for materials"
_Scene = SimpleNamespace(page=SimpleNamespace(address="http://localhost:1"), ports=(1, 2), addresses=())
OAK = load_materials()["oak"].colour
ADDED = "6 % from object to object are added to each spread"
ONE = ["rank", "reach", "--only", "machinist hammer", "--samples", "200", "--know", "nothing"]


@pytest.fixture
def known(tmp_path):
    """Options that name the memory of an observer who knows steel and oak."""
    path = write_known(tmp_path / "m.sqlite", {"cast_steel": 7800.0, "oak": 563.0})
    return ["--memory", path]


def test_memory_decides_and_the_first_line_says_what_to_take(known):
    sentence, title, header, first, *_ = answer(*ONE, *known).lines
    assert title.endswith(f"evidence about oak, cast steel from the memory m.sqlite; {ADDED}")
    assert header.startswith(" ")
    assert "P(feasible)  torque share" in header
    assert first.split()[:3] == ["machinist", "hammer,", "head"]
    assert sentence.startswith("Take the machinist hammer by its head: 5.")
    assert sentence.endswith(" J, best with probability 1.00.")


def test_without_a_memory_it_says_that_it_knows_nothing():
    said = answer(*ONE).out
    assert f"; the prior of any material for oak, cast steel; {ADDED}\n" in said
    assert "is uncertain because of the density of oak (" in said
    assert "the machinist hammer choked would be better." in said


def test_json_has_all_numbers_and_writes_nothing_else(known):
    content = answer(*ONE, *known, "--json", "--by", "margin").content
    keys = "task robot see memory trials_of_other_arms known learned unknown deviation surprises by unit statistic"
    keys += " choice ties options p_none why remarks sentence expected"
    assert set(content) == set(keys.split())
    assert (content["by"], content["unit"], content["statistic"]) == ("margin", "1", "p95")
    assert content["memory"] == "m.sqlite"
    assert (content["known"], content["learned"], content["unknown"]) == ([], ["oak", "cast_steel"], [])
    assert content["choice"] == {"tool": "machinist hammer", "grip": "head"}
    first, *_ = options = content["options"]
    keys = "tool grip alike usable reason cost work effort torque_share grip_force grip_moment p_best p_feasible"
    assert set(first) == set(keys.split())
    assert [each["cost"]["value"] for each in options] == sorted(each["torque_share"]["p95"] for each in options)
    for each in options:
        for name in ("cost", "work", "effort", "torque_share", "grip_force", "grip_moment"):
            assert each[name]["p05"] <= each[name]["mean"] <= each[name]["p95"]
    assert sum(each["p_best"] for each in options) + content["p_none"] == pytest.approx(1.0)
    assert set(content["why"]) == {"rival", "materials", "rest", "changes"}
    shares = [each["share"] for each in content["why"]["materials"]]
    assert sum(shares) + content["why"]["rest"] == pytest.approx(1.0)


def test_what_a_memory_lacks_is_named(tmp_path):
    path = write_known(tmp_path / "m.sqlite", {"cast_steel": 7800.0})
    said = f"; evidence about cast steel from the memory m.sqlite; the prior of any material for oak; {ADDED}\n"
    assert said in answer(*ONE, "--memory", path).out


def test_results_are_written_with_a_picture(tmp_path, known, monkeypatch):
    shots = []
    render = advice_figure.render_poses

    def note(directives, poses, **size):
        shots.extend(poses)
        return render(directives, poses, **size)

    monkeypatch.setattr(advice_figure, "render_poses", note)
    drawn = []
    monkeypatch.setattr(advice_figure, "tidy", lambda *axes: drawn.extend(axes))
    said = answer(*ONE, *known, "--by", "grip", "--out", tmp_path / "out").out
    assert (tmp_path / "out" / "ranking.txt").read_text() == said
    content = json.loads((tmp_path / "out" / "ranking.json").read_text())
    assert content["sentence"] == said.splitlines()[0]
    assert [shot.tool.grip for shot in shots] == [each["grip"] for each in content["options"][:2]]
    assert (tmp_path / "out" / "ranking.png").stat().st_size > 20_000
    assert (tmp_path / "out" / "ranking.svg").exists()
    (of_cost, of_probability) = drawn
    names = [label.get_text().replace("\n", " ") for label in of_cost.get_yticklabels()]
    assert names[0] == f"{content['choice']['tool']}, {content['choice']['grip']}"
    assert of_probability.get_xlabel() == "probability of\nbeing best"


def test_grip_that_cannot_be_held_is_not_taken(known):
    content = answer(*ONE, *known, "--json", "--max-grip-moment", 0.5).content
    by_grip = {each["grip"]: each for each in content["options"]}
    assert not by_grip["handle"]["usable"]
    assert by_grip["handle"]["p_feasible"] == 0.0
    assert by_grip["handle"]["reason"].endswith("N m, --max-grip-moment allows 0.5 N m")
    assert by_grip["head"]["usable"]


def test_nothing_that_can_be_held_is_one_line(known, tmp_path):
    words = ["rank", "hold", *ONE[2:], *known, "--max-grip-force", 1, "--out", tmp_path / "out"]
    said = answer(*words, status=2).err
    assert said.count("\n") == 1
    assert "no tool can do the task; nearest is the machinist hammer " in said
    assert "N, --max-grip-force allows 1 N; the task would be feasible with a tool of 0.2" in said
    assert said.endswith(" times the weight\n")
    assert not (tmp_path / "out").exists()


def test_pictures_are_looked_at_when_they_are_asked_for(monkeypatch):
    looked = []

    def see(tools: list[workbench.Tool], seed: int):
        looked.append((seed, [tool.name for tool in tools]))
        raise AffordanceError("seen enough")

    monkeypatch.setattr(seen_tool, "list_seen_options", see)
    answer(*ONE, "--see", "pictures", "--seed", 3, status=2)
    assert looked == [(3, ["machinist hammer"])]


def test_robot_whose_arm_has_changed_is_said_and_its_trials_count(tmp_path, known, monkeypatch):
    """Every command that recalls a memory says it; identify is asked in test_identify."""
    place = Path(known[1])
    with open_memory(place) as ledger:
        for number, fingerprint in enumerate(("of another", Robot().chain.fingerprint)):
            trial = hold("bar", [OAK], [563.0], number)
            ledger.append([replace(trial, robot="the paper's arm", fingerprint=fingerprint)])
    said = answer(*ONE, *known).out
    assert PAST in said
    assert "knows nothing" not in said
    assert answer("next", *ONE[1:], *known).lines[1] == PAST
    monkeypatch.setattr(run, "run_suite", lambda *_, **__: (tmp_path, {}, {}))
    assert answer("run", "weight", *known).lines[0] == PAST
    monkeypatch.setattr(watch, "Show", lambda name, setup: SimpleNamespace(scene=_Scene, run=lambda: None))
    assert answer("watch", *known).lines[0] == PAST


def test_tool_without_grips_cannot_be_ranked():
    mallet = HAMMERS["mallet"]
    with pytest.raises(AffordanceError, match="has no grips, must have at least one"):
        options.choose_tools([mallet.gripped_by(mallet.grips[0])], [], MODELS)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """Folder of models of an arm of four joints, imported from its URDF."""
    root = tmp_path_factory.mktemp("robot")
    options = ImportOptions("right_tool", effort={"": 30.0, "right_j3": 4.5})
    import_arm(write_urdf(root), options, root / "two_arms", with_meshes=False, fits_tasks=False)
    return root / "two_arms"


def test_any_robot_is_ranked_by_what_its_gripper_must_hold(robot, known, tmp_path):
    content = answer(*ONE, *known, "--robot", robot, "--json", "--out", tmp_path / "out").content
    assert (content["robot"], content["by"], content["unit"]) == ("two_arms", "grip", "N")
    assert {each["torque_share"]["joint"] for each in content["options"]} == {"right_j3"}
    for each in content["options"]:
        force, moment, cost = (each[name] for name in ("grip_force", "grip_moment", "cost"))
        assert (
            max(force["p95"], moment["p05"] / GRIP_LEVER) < cost["value"] < force["p95"] + moment["p95"] / GRIP_LEVER
        )
    assert (tmp_path / "out" / "ranking.png").stat().st_size > 20_000
    content = answer(*ONE, *known, "--robot", robot, "--json", "--by", "work").content
    works = [each["work"]["mean"] for each in content["options"]]
    assert works == sorted(works)


def test_task_of_a_file_is_done_by_any_robot(robot, known, tmp_path):
    path = tmp_path / "aside.yaml"
    path.write_text("kind: hold\nduration: 2\nposture: {right_j3: 1.0}\n")
    words = ["rank", *ONE[2:], *known, "--task", path, "--robot", robot]
    sentence, title, *_ = answer(*words, "--by", "effort").lines
    assert title.startswith("aside with two_arms, compared by the joints' expected effort; evidence about oak")
    assert sentence.startswith("Take the machinist hammer by its handle: ")
    path.write_text("kind: hold\nduration: 2\nposture: {right_j3: 2.45}\n")
    assert "sets right_j3 to 2.45 rad, must be from -2.5 to 2.4 rad" in answer(*words, status=2).err


KINDS = "hammer, reach, mash, carry, hold"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("reach --samples 0", "--samples: is 0, must be from 1 to 100000"),
        ("reach --seed -1", "--seed: is -1, must be from 0 to 4294967295"),
        (
            "reach --only mallett",
            "--only: is 'mallett', must be one of claw hammer, machinist hammer, mallet; did you mean 'mallet'?",
        ),
        ("reach --max-grip-force -3", "--max-grip-force: is -3.0, must be from 0.001 to 100000 N"),
        ("reach --max-grip-moment 1e9", "--max-grip-moment: is 1000000000.0, must be from 0.001 to 10000 N m"),
        ("reach --memory nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("reach --tools nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("reach --tip right_tool", "--tip: applies to a robot's file only, which --robot must name"),
        ("reach --set cost_measure=effort", "--set: cost_measure: has no effect here: --by says what is compared"),
        ("reach --robot .", "has no arm.dmd.yaml, must be a folder that import-arm wrote"),
        ("reach --robot nowhere", "--robot: is 'nowhere', which is neither a folder nor a robot's file"),
        ("reach --demo", "--demo: uses its own data, must be given without a task"),
        ("--demo --task my.yaml", "--demo: uses its own data, must be given without --task"),
    ],
)
def test_mistake_is_refused_in_one_line(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("rank", *words.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("fly", f"two_arms: task: is 'fly', must be one of {KINDS}"),
        ("", f"task: is missing, must be one of {KINDS}, or a file with --task"),
        ("reach --task my.yaml", "task: is given 2 times, must be given once; affordance next takes several"),
        ("--task my.yaml", "my.yaml: cannot be read"),
        ("hold --by work", "--by: is 'work', which is zero for holding still, must be one of effort, margin, grip"),
        (
            "reach --tip right_tool",
            "--tip: applies to a robot's file only, which --robot must name in place of the folder",
        ),
        ("reach --robot nowhere --tip flange", "--robot: is 'nowhere', which is neither a folder nor a robot's file"),
        ("hammer --samples 10", "no tool can do the task; nearest is "),
    ],
)
def test_mistake_with_an_imported_robot_is_refused(robot, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("rank", "--robot", robot, "--only", "mallet", *words.split())


@pytest.mark.parametrize(
    ("task", "said"),
    [
        (
            "kind: hold\nduration: 1\nposture: {rigth_j3: 1}\n",
            "mine.yaml: posture.rigth_j3: is 'rigth_j3', must be one of right_j1, right_j2, right_j3, right_j4;"
            " did you mean 'right_j3'?",
        ),
        (
            "kind: reach\nduration: 1\ntolerance: 0.1\npoints: [[0, 0, 0.1]]\nstart: {right_j1: 2.5}\n",
            "mine.yaml: start.right_j1: sets right_j1 to 2.5 rad, must be from -2.5 to 2.4 rad",
        ),
    ],
)
def test_joints_of_a_task_are_those_of_the_robot(robot, tmp_path, monkeypatch, task, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(task)
    assert said in refuse_command("rank", "--robot", robot, "--only", "mallet", "--task", "mine.yaml")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "",
            "--tip: is missing, must be the link or frame of two_arms.urdf that holds objects; limbs end in right_4",
        ),
        ("--tip third_hand", "--tip: is 'third_hand', which is not in two_arms.urdf; limbs end in right_4"),
    ],
)
def test_tip_of_a_robots_file_must_be_given(tmp_path, monkeypatch, words, said):
    write_urdf(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("rank", "reach", "--robot", "two_arms.urdf", "--out", "out", *words.split())


CLUB = """tools:
  - name: club
    mass: 1.2
    components:
      - {cylinder: [0.02, 0.3], material: oak}
      - {semi_axes: [0.03, 0.03, 0.03], position: [0, 0, 0.15], material: steel}
      - {semi_axes: [0.03, 0.03, 0.03], position: [0, 0, -0.15], material: steel}
    grips:
      top: {position: [0, 0, 0.1], rpy_deg: [0, -90, 0]}
      bottom: {position: [0, 0, -0.1], rpy_deg: [0, 90, 0]}
      middle: {rpy_deg: [0, 90, 0]}
"""


@pytest.fixture
def club(tmp_path):
    """Options that name a tool with two ends that are alike, and its file."""
    path = tmp_path / "club.yaml"
    path.write_text(CLUB)
    return ["rank", "reach", "--samples", "200", "--tools", path]


def test_names_of_materials_are_known_unless_it_is_told_otherwise():
    hammer = ONE[:-2]
    content = answer(*hammer, "--json").content
    assert (content["known"], content["unknown"]) == (["oak", "cast_steel"], [])
    assert content["options"][0]["p_best"] == 1.0
    content = answer(*hammer, "--know", "oak", "--json").content
    assert (content["known"], content["unknown"]) == (["oak"], ["cast_steel"])
    said = answer(*hammer, "--know", "oka", status=2).err
    assert "--know: is 'oka', must be one of" in said
    assert said.endswith("did you mean 'oak'?\n")


def test_weighing_narrows_what_the_grip_must_hold(club):
    wide, narrow = (
        answer(*club, "--know", "nothing", "--json", *more).content["options"][0]["grip_force"]
        for more in (["--tools", club[-1].with_name("light.yaml")] if light(club[-1]) else [], [])
    )
    assert narrow["p95"] - narrow["p05"] < 0.1 * (wide["p95"] - wide["p05"])


def light(path):
    """Writes a second tool file, in which the mass of the tool is missing."""
    return path.with_name("light.yaml").write_text(CLUB.replace("    mass: 1.2\n", ""))


def test_ends_that_are_alike_are_either_end(club):
    answered = answer(*club)
    assert "the club by either end" in answered.out
    assert any(line.startswith("  club, top or bottom") for line in answered.lines)
    options = answer(*club, "--json").content["options"]
    assert {each["grip"]: each["alike"] for each in options} == {"top": ["bottom"], "middle": []}
    assert sum(each["p_best"] for each in options) == pytest.approx(1.0)


def test_ends_that_cost_the_same_are_said(tmp_path):
    """Held still by mirrored ends, a bar asks the same of the grip, though it lies on either side of the hand."""
    path = tmp_path / "bar.yaml"
    grips = "{left: {position: [-0.12, 0, 0]}, right: {position: [0.12, 0, 0]}, near: {position: [0.1, 0, 0]}}"
    path.write_text(
        f"tools:\n  - name: bar\n    components: [{{box: [0.3, 0.03, 0.03], material: oak}}]\n    grips: {grips}\n"
    )
    words = ["rank", "hold", "--tools", path, "--samples", "4000"]
    both = answer(*words, "--json").content
    assert both["choice"]["grip"] == "near"
    assert both["ties"] == []
    path.write_text(path.read_text().replace(", near: {position: [0.1, 0, 0]}", ""))
    two = answer(*words, "--json").content
    (tied,) = two["ties"]
    assert {two["choice"]["grip"], tied["grip"]} == {"left", "right"}
    assert f"; the bar by its {tied['grip']} costs the same to 0.1 %" in two["sentence"]


def test_tool_without_a_striking_face_is_no_option_for_a_blow(club, tmp_path):
    said = answer("rank", "hammer", *club[2:], status=2).err
    assert "club.yaml: tools: has no tool with a striking face, must have strikes: {NAME: {point:" in said
    both = tmp_path / "both.yaml"
    face = "    strikes: {side: {point: [0.03, 0, 0.15], normal: [1, 0, 0]}}\n"
    both.write_text(CLUB + CLUB.replace("tools:\n", "").replace("name: club", "name: beetle") + face)
    content = answer("rank", "hammer", "--samples", "200", "--tools", both, "--json").content
    assert {each["tool"] for each in content["options"]} == {"beetle"}
    assert content["remarks"] == ["club has no striking face (strikes) and cannot be used for a blow"]
    assert content["sentence"].endswith("best with probability 1.00; no other option can be used.")


def test_blow_with_the_face_in_the_hand_is_not_ranked_and_rubber_is_said(known):
    """Such a grip would strike with the handle; Python leaves out what the command leaves out."""
    content = answer("rank", "hammer", "--samples", "200", "--know", "nothing", "--json").content
    reasons = {each["reason"] for each in content["options"] if each["grip"] == "head"}
    assert reasons == {"the face is in the hand in this grip"}
    assert all(each["usable"] or each["reason"] for each in content["options"])
    assert content["remarks"] == ["mallet strikes with rubber; its blow is computed as that of a hard face"]
    options = [option for tool in load_tools(MODELS / "workshop" / "tools.yaml") for option in list_options(tool)]
    bare = [
        replace(each, object_name="bare", features=tuple(replace(part, strikes=()) for part in each.features))
        for each in options[:1]
    ]
    ranking = rank([*options, *bare], load_hammer(MODELS / "nail.yaml"), MaterialMemory(), num_samples=50)
    assert "bare" not in {each.option.object_name for each in ranking.ranked}
    assert {each.option.grip for each in ranking.ranked if each.infeasible_reason} >= {"head"}


def test_task_that_the_import_found_infeasible_is_said(tmp_path):
    models = tmp_path / "weak"
    shutil.copytree(MODELS, models)
    write_lacks(models, {"blow": "the peak is 511 N, 427 N are demanded", "path": "too far"})
    words = ["hammer", "--samples", "200", "--only", "claw hammer", "--by", "work", "--robot", models]
    said = "the import found hammer infeasible for this arm: the peak is 511 N, 427 N are demanded"
    assert said in answer("rank", *words, "--json").content["remarks"]
    assert f"warning: {said}" in answer("next", *words).lines
    assert "the import found reach infeasible" in answer("rank", "reach", *words[1:]).out


@pytest.mark.parametrize("width", [60, 80, 140])
def test_text_fits_the_terminal(known, monkeypatch, width):
    monkeypatch.setattr("affordance.commands.advice.rank.find_width", lambda: width)
    lines = answer(*ONE, *known).lines
    assert max(map(len, lines)) <= width
    header = next(line for line in lines if "P(best)" in line)
    assert ("moment (N m)" in header) == (width == 140)


def test_option_that_is_best_more_often_is_named_with_the_reason_why_it_is_not_taken():
    """Knowing nothing, a heavy head is often the cheapest end, and now and then far the dearest."""
    answered = answer("rank", "hammer", "--know", "nothing", "--json").content
    first, *others = answered["options"]
    often = max(others, key=lambda each: each["p_best"])
    assert often["p_best"] > first["p_best"]
    name = f"the {often['tool']} by its {often['grip']}"
    assert f"; {name} is best more often ({often['p_best']:.2f}), but costs more on average (" in answered["sentence"]


def test_payload_leaves_a_torque_at_each_joint(robot):
    """At rest, the torque of a point mass is its weight times the arm's Jacobian, in addition to the arm's own."""
    arm = Robot(robot).arm
    model = ArmModel(arm)
    model.set_posture(arm.home)
    p, mass = np.array([0.05, 0.0, 0.02]), 0.06
    own = model.compute_inverse_dynamics(np.zeros(arm.num_joints))
    tau = own - model.compute_point_jacobian(p).T @ (mass * model.gravity)
    words = ["rank", "hold", "--robot", robot, "--payload", mass, "--payload-at", *p]
    content = answer(*words, "--json").content
    np.testing.assert_allclose([each["needed"] for each in content["joints"]], np.abs(tau), rtol=1e-6, atol=1e-9)
    for each in content["joints"]:
        assert each["margin"] == pytest.approx(each["limit"] - each["needed"])
    assert content["grip_force"] == pytest.approx(mass * 9.81)
    assert "0.0600 kg at (0.05 0 0.02) m in the hand fits: " in answer(*words).lines[0]
    assert "is too heavy" in answer(*words[:-5], 500, status=3).lines[0]


def test_objects_own_urdf_is_a_tool_whose_placeholder_moments_are_named(tmp_path):
    path = tmp_path / "club.urdf"
    path.write_text(
        '<robot name="club"><link name="body"><inertial><mass value="0.9"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><geometry><cylinder radius="0.02" length="0.3"/></geometry><material name="oak"/></visual></link>'
        '<link name="near"/><joint name="j" type="fixed"><parent link="body"/><child link="near"/>'
        '<origin xyz="0 0 -0.1" rpy="0 -1.5708 0"/></joint></robot>'
    )
    answered = answer("rank", "carry", "--tools", path, "--know", "nothing", "--samples", "200")
    assert "warning: club.urdf: link body has principal moments of 1 1 1 kg m^2, and its shape" in answered.out
    (option,) = answer("rank", "hold", "--tools", path, "--know", "nothing", "--json").content["options"]
    assert option["grip"] == "near"
    assert option["grip_force"]["mean"] == pytest.approx(0.9 * 9.81, rel=0.01)
