"""``affordance next``: its table and sentences, its JSON, and one line for bad input."""

import json

from helpers.trials import write_known

from affordance.cli import main

ONE = ["next", "reach", "--only", "machinist hammer", "--samples", "800"]


def test_what_to_hold_is_said_tabulated_and_drawn(tmp_path, capsys):
    assert main([*ONE, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert said.startswith("reach: take the machinist hammer by ")
    assert said.strip().split("\n")[-1].startswith("Hold the ")
    content = json.loads((tmp_path / "out" / "next.json").read_text())
    assert (tmp_path / "out" / "next.txt").read_text() == said
    assert (tmp_path / "out" / "next.png").stat().st_size > 1000
    assert [each["worth"] for each in content["ranked"]] == sorted(
        (each["worth"] for each in content["ranked"]), reverse=True
    )
    assert {each["name"] for each in content["ranked"]} == {
        "bar of oak",
        "rod of cast steel",
        "block of rubber",
        "sheet of stainless steel",
        "pin of brass",
    }
    assert content["unit"] == "J"
    assert content["decisions"][0]["name"] == "reach"


def test_who_knows_its_materials_is_told_on_what_that_rests_and_how_to_check_it(tmp_path, capsys):
    known = write_known(tmp_path / "m.sqlite", {"cast_steel": 7800.0, "oak": 563.0})
    assert main([*ONE, "--memory", str(known), "--include-tools", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["stop"], content["rests_on"]) == ("", ["stock"])
    assert content["check"] in {each["name"] for each in content["ranked"]}
    assert content["sentence"].endswith(" to check: the choice for reach rests on the stock alone.")
    assert "machinist hammer" in {each["name"] for each in content["ranked"]}
    assert main([*ONE, "--memory", str(known), "--price", "100"]) == 0
    assert "Nothing more needs to be held: every choice is certain. But the" in capsys.readouterr().out


def test_a_tool_seen_in_pictures_may_be_held_itself(capsys):
    assert main([*ONE, "--see", "pictures", "--include-tools", "--json"]) == 0
    ranked = {each["name"]: each for each in json.loads(capsys.readouterr().out)["ranked"]}
    assert ranked["machinist hammer"]["worth"] > 3.0 * ranked["machinist hammer"]["worth_se"]
    assert ranked["machinist hammer"]["worth"] < ranked["bar of oak"]["worth"]  # it mixes two materials
    assert ranked["pin of brass"]["worth"] < 0.01
