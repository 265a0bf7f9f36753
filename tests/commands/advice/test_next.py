"""``affordance next``: its table and sentences, its JSON, and plain answers where nothing is to be gained."""

import json
import re
from types import SimpleNamespace

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.trials import write_known

from affordance.commands.advice.next import describe_holds
from affordance.extensions.advice.next_hold import OpenDecision

ANY = ["next", "reach", "--samples", 800, "--know", "nothing"]
ONE = [*ANY, "--only", "machinist hammer"]


def test_what_to_hold_is_said_tabulated_and_drawn(tmp_path):
    said = answer(*ONE, "--out", tmp_path / "out").out
    assert said.startswith("Hold the ")
    assert said.splitlines()[1].startswith("reach: take the machinist hammer by its ")
    content = json.loads((tmp_path / "out" / "next.json").read_text())
    assert (tmp_path / "out" / "next.txt").read_text() == said
    assert (tmp_path / "out" / "next.png").stat().st_size > 1000
    worths = [each["worth"] for each in content["ranked"]]
    assert worths == sorted(worths, reverse=True)
    stock = {"bar of oak", "rod of cast steel", "block of rubber", "sheet of stainless steel", "pin of brass"}
    assert {each["name"] for each in content["ranked"]} == stock
    assert content["unit"] == "J"
    assert content["decisions"][0]["name"] == "reach"


def test_who_knows_its_materials_is_told_on_what_that_rests_and_how_to_check_it(tmp_path):
    known = write_known(tmp_path / "m.sqlite", {"cast_steel": 7800.0, "oak": 563.0}, things=1)
    content = answer(*ONE, "--memory", known, "--include-tools", "--json").content
    assert (content["stop"], content["rests_on"]) == ("", ["stock #2"])
    assert content["check"] in {each["name"] for each in content["ranked"]}
    assert content["sentence"].endswith(" to check: the choice for reach rests on the stock #2 alone.")
    assert "machinist hammer" in {each["name"] for each in content["ranked"]}
    said = answer(*ONE, "--memory", known, "--price", 100).out
    p_best = content["decisions"][0]["p_best"]
    assert f"Nothing more needs to be held: reach is decided (P = {p_best:.2f}). But the" in said


def test_a_tool_seen_in_pictures_may_be_held_itself():
    content = answer(*ONE, "--see", "pictures", "--include-tools", "--json").content
    ranked = {each["name"]: each for each in content["ranked"]}
    assert ranked["machinist hammer"]["worth"] > 3.0 * ranked["machinist hammer"]["worth_se"]
    assert ranked["machinist hammer"]["worth"] < ranked["bar of oak"]["worth"]  # it mixes two materials
    assert ranked["pin of brass"]["worth"] < 0.01


def test_open_choice_stays_open_if_no_hold_is_worth_its_price():
    said = answer(*ONE, "--price", 100).out
    assert "Nothing here is worth its price of 100 J: the bar of oak would save 0." in said
    assert "reach stays open (P = 0." in said


def test_sentence_says_worth_and_what_to_hold_then():
    one = answer(*ONE, "--json").content
    assert one["sentence"].startswith("Hold the bar of oak: worth 0.")
    assert one["plan"][:2] == ["bar of oak", "rod of cast steel"]
    assert " J; then the rod of cast steel" in one["sentence"]


def test_table_keeps_its_columns_beside_objects_that_may_be_too_heavy(monkeypatch):
    monkeypatch.setattr("affordance.commands.advice.next.find_width", lambda: 88)
    out = answer(*ONE).out
    assert "information (nat)  P(best) after\n" in out
    assert "\nThe arm can hold the bar of oak with probability 0." in out


def test_criterion_and_grip_of_a_choice_are_those_of_a_ranking(tmp_path):
    """Holding still is compared by the grip, as by rank; what the gripper cannot hold is no option."""
    path = tmp_path / "aside.yaml"
    path.write_text("kind: hold\nduration: 1\n")
    words = ["--samples", 800, "--only", "mallet", "--only", "machinist hammer", "--know", "nothing", "--task", path]
    words = [*words, "--json"]
    asked, ranked = (answer(command, *words).content for command in ("next", "rank"))
    assert (asked["unit"], asked["decisions"][0]["name"]) == (ranked["unit"], "aside") == ("N", "aside")
    (decision,) = asked["decisions"]
    assert decision["cost"] > 0.0
    assert decision["best"] == "{tool} by {grip}".format(**ranked["choice"])
    force = next(each["grip_force"]["p05"] for each in ranked["options"] if each["tool"] == "mallet")
    possible = [
        answer("next", "reach", *words[:8], *more, "--json").content["decisions"][0]["p_possible"]
        for more in ([], ["--max-grip-force", 0.5 * force])
    ]
    assert possible[1] < 0.5 < possible[0]


def test_tie_says_by_how_little_the_best_two_differ(tmp_path):
    """Held on its left or right, a bar asks the same of the grip: the rest is rounding."""
    grips = "{one: {position: [0, -0.005, 0]}, two: {position: [0, 0.005, 0]}}"
    words = ["next", "hold", *ANY[2:], *write_tools(tmp_path, "[0.2, 0.02, 0.01]", grips)]
    said = answer(*words).out
    assert said.startswith("Nothing here is worth holding: hold is a tie (P = 0.50): the best two differ by 0 N.\n")


def test_task_that_no_option_can_do_is_refused_as_by_a_ranking(tmp_path):
    grips = "{one: {position: [0, 0, 0]}, two: {position: [0.1, 0, 0]}}"
    tools = write_tools(tmp_path, "[0.9, 0.8, 0.8]", grips)
    refused, ranked = (answer(each, "reach", "--samples", 800, *tools, status=2) for each in ("next", "rank"))
    assert refused.err == ranked.err
    assert refused.err.startswith("affordance: no tool can do the task; nearest is ")


def test_task_that_one_of_two_tools_can_do_is_told_beside_the_other(tmp_path):
    """A task that cannot be done does not hide the advice about another."""
    words = ["hold", "hammer", "--samples", 800, "--only", "mallet", "--max-grip-force", 10, "--know", "nothing"]
    said = answer("next", *words).lines
    assert said.pop(1) == "warning: mallet strikes with rubber; its blow is computed as that of a hard face"
    assert said[1].startswith("hold: no option is usable yet: the mallet ")
    assert said[2].startswith("hammer: no option can do it (P = ")


def test_tool_that_a_ranking_would_not_take_is_not_taken(tmp_path):
    """A grip that is feasible with less than .95 is named as the nearest; what is held may make it usable."""
    words = ["hammer", "--samples", 800, "--only", "mallet", "--only", "claw hammer", "--max-grip-force", 20]
    words += ["--know", "nothing"]
    refused, advised = answer("rank", *words, status=2), answer("next", *words)
    nearest = re.search(r"nearest is (the .*?): is feasible with a probability of (0\.\d+)", refused.err)
    assert advised.lines[2].startswith(f"hammer: no option is usable yet: {nearest[1]} comes nearest, feasible ")
    assert advised.lines[0].startswith("Hold the ")
    (decision,) = answer("next", *words, "--json").content["decisions"]
    assert decision["is_usable"] is False
    assert decision["p_feasible"] == pytest.approx(float(nearest[2]), abs=0.05)


@pytest.mark.parametrize("by", ["work", "margin", "grip"])
def test_what_is_taken_now_is_what_a_ranking_takes(by):
    """Peaks are compared by their 95 % quantile, and what is hardly feasible is not taken, as in a ranking."""
    words = ["hammer", "--samples", 4000, "--by", by, "--know", "nothing", "--json"]
    ranked, advised = answer("rank", *words).content, answer("next", *words).content
    assert advised["decisions"][0]["best"] == "{tool} by {grip}".format(**ranked["choice"])


def test_object_that_the_arm_cannot_hold_is_worth_nothing(tmp_path):
    heavy = write_tools(tmp_path, "[0.6, 0.5, 0.5]", "{one: {position: [0, 0, 0]}}")[1]
    content = answer(*ONE, "--may-hold", heavy, "--json").content
    (block,) = content["ranked"]
    assert block["p_held"] < 0.05
    assert (block["worth"], block["information"], content["stop"]) == (0.0, 0.0, "not worth its price")


def test_colours_that_count_as_one_are_doubted_together(tmp_path):
    """Doubts about things at odds are the same, whether one colour or two that count as one show their material."""
    for name, second in (("one", "#b07a45"), ("two", "#305a95")):
        place = write_known(tmp_path / f"{name}.sqlite", {"cast_steel": 7800.0}, things=1)
        write_known(place, {"#b07a45": 563.0}, name="plank", things=1)
        write_known(place, {second: 7200.0}, name="other plank", things=1)
    one, apart = (answer(*ANY, "--memory", tmp_path / f"{name}.sqlite", "--json").content for name in ("one", "two"))
    answer("memory", "join", place, "#b07a45=#305a95")
    two = answer(*ANY, "--memory", place, "--json").content
    assert two["rests_on"] == one["rests_on"]
    assert two["decisions"] == one["decisions"] != apart["decisions"]


def test_object_with_the_name_of_a_tool_is_refused_and_tools_may_be_what_is_held(tmp_path):
    tools = write_tools(tmp_path, "[0.4, 0.03, 0.03]", "{one: {position: [0, 0, 0]}, two: {position: [0.1, 0, 0]}}")
    own = tmp_path / "own.yaml"
    own.write_text((tmp_path / "tools.yaml").read_text().replace("oak", "brass"))
    assert "'block' is also a tool of" in answer(*ANY, *tools, "--may-hold", own, status=2).err
    assert "Hold the block: worth" in answer(*ANY, *tools, "--may-hold", tools[1], "--include-tools").out


def write_tools(folder, box, grips):
    """Writes a file with a block of oak; returns the option that names it."""
    place = folder / "tools.yaml"
    part = f"{{box: {box}, position: [0.1, 0, 0], material: oak}}"
    place.write_text(f"tools:\n  - name: block\n    components: [{part}]\n    grips: {grips}\n")
    return ["--tools", str(place)]


TASKS = "hammer, reach, mash, carry, hold"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("reech", f"task: is 'reech', must be one of {TASKS}"),
        ("", f"task: is missing, must be one of {TASKS}, or a file with --task"),
        ("reach --task reach.yaml", "--task: is 'reach.yaml', must not have the same name as another task, reach"),
        ("reach --only nothing", "--only: is 'nothing', must be one of"),
        ("reach --may-hold nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("reach --price nan", "--price: is nan"),
        ("reach --samples 3", "--samples: is 3, must be from 100"),
        ("reach --memory nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("reach --set cost_measure=effort", "--set: cost_measure: has no effect here: --by says what is compared"),
        (
            "reach hold --by work",
            "--by: is 'work', which is zero for holding still, must be one of effort, margin, grip",
        ),
        ("reach --max-grip-force -3", "--max-grip-force: is -3.0, must be from 0.001 to 100000 N"),
    ],
)
def test_mistake_is_refused_in_one_line(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("next", *words.split())


def test_ends_that_are_alike_are_one_choice(tmp_path):
    path = tmp_path / "bars.yaml"
    grips = "{left: {position: [-0.12, 0, 0]}, right: {position: [0.12, 0, 0], rpy_deg: [0, 0, 180]}}"
    path.write_text(
        f"tools: [{{name: bar, components: [{{box: [0.3, 0.03, 0.03], material: oak}}], grips: {grips}}}]\n"
    )
    said = answer("next", "hold", "--tools", path, "--samples", 200).out
    assert "Nothing more needs to be held: hold is decided (P = 1.00)." in said
    assert "hold: take the bar by either end, best with probability 1.00; expected loss 0 N" in said


def test_limit_that_stops_a_task_is_named():
    stopped = OpenDecision(
        "reach", "bar by left", False, 0.0, 0.0, 0.0, 1.0, None, 0.0, ("right",), "j2 must bear 5.47"
    )
    nothing = describe_holds(SimpleNamespace(decisions=[stopped], ranked=[], unit="N"))[0]
    assert nothing == "reach: no option can do it (P = 1.000); nearest is the bar by either end: j2 must bear 5.47"
    seldom = stopped._replace(p_feasible=0.4, p_possible=0.4)
    (line, *_) = describe_holds(SimpleNamespace(decisions=[seldom], ranked=[], unit="N"))
    assert line.endswith("feasible with probability 0.40, which must be at least 0.95: j2 must bear 5.47")
