"""``affordance see``: its answer, files and exit statuses, and the commands that read its tools file."""

import json
import shutil

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from PIL import Image

from affordance.extensions.pixels.photographs.example import CANS, cast_example, write_examples
from affordance.extensions.pixels.photographs.ray_scene import ScenePart, box_gauge, cast_scene, look_at, spoil
from affordance.objects.load import load_tools
from affordance.objects.tool_entries import build_pose


@pytest.fixture(scope="session")
def examples(tmp_path_factory):
    folder = tmp_path_factory.mktemp("see") / "demo"
    write_examples(folder)
    return folder


@pytest.fixture
def demo(examples, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(examples, tmp_path / "demo")
    return tmp_path / "demo"


def see(name, *words, status=0):
    files = (f"demo/{name}.png", "--depth", f"demo/{name}_depth.png", "--camera", "demo/camera.json")
    return answer("see", *files, *words, status=status)


def test_picture_becomes_a_tool_that_is_guessed_weighed_and_guessed_again(demo, tmp_path):
    said = see("can", "--holds", "liquid", "--json").content
    radius, height, mass = CANS["can"]
    assert said["volume"]["p05"] < np.pi * radius**2 * height < said["volume"]["p95"]
    assert said["mass"]["p05"] < mass < said["mass"]["p95"]
    assert said["chosen"] == "nearest to the middle"
    assert (said["tools"], said["doubts"], said["materials"]) == ("can/tools.yaml", [], ["holds_liquid"])
    assert np.array(Image.open(tmp_path / "can" / "seen.png")).shape == (960, 1280, 3)
    # A large can of the same look, before and after the first one was weighed.
    large = see("large_can", "--same-colour", "can/tools.yaml", "--json").content
    guessed = answer("guess", "large_can/tools.yaml", "--json").content["expected"][0]["mass"]
    assert guessed == large["mass"]
    text = (tmp_path / "can" / "tools.yaml").read_text()
    (tmp_path / "can" / "tools.yaml").write_text(text.replace("- name: can", f"- name: can\n  mass: {mass}"))
    answer("memory", "weigh", "stock.sqlite", "can/tools.yaml")
    after = answer("guess", "large_can/tools.yaml", "--memory", "stock.sqlite", "--json").content["expected"][0][
        "mass"
    ]
    assert after["p05"] < CANS["large_can"][2] < after["p95"]
    assert after["p95"] / after["p05"] < 0.3 * guessed["p95"] / guessed["p05"]
    told = answer("guess", "can/tools.yaml", "--json").content["expected"][0]["mass"]
    assert told["mean"] == pytest.approx(mass, rel=0.02)


def test_hammer_is_ranked_by_the_end_that_is_held(demo):
    see("hammer", "--material", "oak,steel")
    tool, *others = load_tools("hammer/tools.yaml")
    assert not others
    assert len(tool.components) == 2
    words = ("rank", "carry", "--tools", "hammer/tools.yaml", "--by", "grip", "--samples", 200, "--json")
    assert answer(*words).content["choice"]["grip"] == "end_b"  # next to the head


def test_doubted_object_needs_an_outline(demo, tmp_path):
    _, camera = cast_example("can")
    parts = []
    for x, half in ((0.0, [0.03, 0.03, 0.07]), (0.075, [0.045, 0.03, 0.015])):  # they touch
        X = build_pose([x, 0.0, half[2]])
        parts.append(ScenePart(box_gauge(half, X), X[:3, 3], 0.1, (0.7, 0.3, 0.2)))
    clean, shown = cast_scene(parts, camera, look_at(0.7, 0.7))
    picture = spoil(clean, shown, camera, np.random.default_rng(0))
    Image.fromarray(picture.colour).save(demo / "can.png")
    Image.fromarray(np.rint(1e3 * np.nan_to_num(picture.depth)).astype(np.uint16)).save(demo / "can_depth.png")
    said = see("can", status=3)
    assert "DOUBTED: it is no simple solid" in said.out
    assert not (tmp_path / "can" / "tools.yaml").exists()
    assert (tmp_path / "can" / "seen.png").exists()
    Image.fromarray(255 * (shown == 0).astype(np.uint8)).save(demo / "mask.png")
    said = see("can", "--mask", "demo/mask.png", "--json").content
    assert said["volume"]["p05"] < 8.0 * 0.03 * 0.03 * 0.07 < said["volume"]["p95"]
    assert (tmp_path / "can" / "tools.yaml").exists()


FILES = ("demo/can.png", "--depth", "demo/can_depth.png", "--camera", "demo/camera.json")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "COLOUR: is missing: see --help, or --demo DIR"),
        (("demo/can.png",), "--depth: is missing"),
        (FILES[:3], "--camera: is missing: without intrinsics a size cannot be measured"),
        ((*FILES, "--holds", "stones"), "--holds: is 'stones', must be one of liquid, powder, dry_food, air"),
        ((*FILES, "--material", "unobtainium"), "--material: is 'unobtainium', must be one of brass"),
        ((*FILES, "--material", "oak", "--holds", "liquid"), "--holds: is given together with --material"),
        ((*FILES, "--material", "oak,oak,oak"), "--material: has 3 names, must have one, or one for each of two"),
        ((*FILES, "--at", 900, 20), "--at: is 900.0, must be from 0 to 639 pixels"),
        ((*FILES, "--at", 20, 400), "can.png: pixel (20, 400) shows no object above the table"),
        ((*FILES, "--at", 20, 400, "--mask", "demo/can.png"), "--at: is given together with --mask"),
        ((*FILES, "--depth-unit", 0.01), "can_depth.png: shows things"),
        ((*FILES, "--depth-unit", -1), "--depth-unit: is -1.0, must be from 1e-06 to 1 m"),
        ((*FILES[:3], "--camera", "demo/can.json"), "can.json: cannot be read: No such file"),
        (("demo/camera.json", *FILES[1:]), "camera.json: is no readable picture, must be PNG or JPEG or TIFF"),
        (("--demo", "demo"), "demo: exists already, must be a new folder"),
        ((*FILES, "--demo", "new"), "--demo: uses its own data, must be given without COLOUR"),
    ],
)
def test_mistakes_are_refused_in_one_line(demo, words, said):
    assert said in refuse_command("see", *words)


def test_demo_says_what_to_do_next(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = answer("see", "--demo", "pictures")
    assert said.lines[-1].startswith("affordance see pictures/can.png --depth pictures/can_depth.png --camera")
    assert json.loads((tmp_path / "pictures" / "camera.json").read_text())["fx"] == 610.0
