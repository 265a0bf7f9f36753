import base64
import gc
import re
import threading

import msgpack
import numpy as np
import pytest
from helpers.browser import open_page
from helpers.watched import EXTENT

from affordance.choice.hammer import load_hammer
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.nail import NailPlacement
from affordance.reporting.replay import Scene, write_replay


@pytest.fixture
def scenes(weight, arm):
    times = np.linspace(0, 0.2, 21)
    q = arm.home + np.zeros((21, 7))
    return [Scene(tool, times, q, f"{tool.name} <shown>") for tool in weight.tools[:2]]


def test_replay_is_one_page_that_needs_nothing_else(tmp_path, weight, scenes):
    path = tmp_path / "replay.html"
    write_replay(path, weight.settings.arm, scenes, title="A & B")
    page = path.read_text(encoding="utf-8")
    assert "<title>A &amp; B</title>" in page
    assert "red line: the goal" in page
    assert "0.0 to 0.2 s: rod_10cm &lt;shown&gt;" in page
    assert "0.7 to 0.9 s: rod_15cm" in page
    # Everything is carried inside; nothing is fetched.
    assert 'src="http' not in page
    assert 1e6 < len(page) < 5e6


@pytest.mark.parametrize(("width", "height"), [(420, 750), (1200, 700), (1200, 420)])
def test_arm_is_wholly_seen_and_large_above_a_bar_that_plays(tmp_path, weight, scenes, width, height):
    """The arm takes more than half of the width, if the window is not low; clock and caption follow the bar."""
    path = tmp_path / "replay.html"
    write_replay(path, weight.settings.arm, scenes, title="A & B")
    with open_page(width, height) as page:
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(path.as_uri())
        clock, bar = page.locator("#bar output"), page.locator("#bar")
        page.wait_for_function("() => viewer.animator.duration > 1 && !viewer.animator.playing")  # played once
        for time, caption in (("0.1", "0.0 to 0.2 s: rod_10cm <shown>"), ("0.8", "0.7 to 0.9 s: rod_15cm <shown>")):
            bar.locator("input").fill(time)
            page.wait_for_function(f"() => document.querySelector('#bar .now').textContent == '{caption}'")
            assert clock.text_content() == f"{time} of 1.4 s"
            left, right, low, high = page.evaluate(EXTENT)
            assert -1.0 < left < right < 1.0
            assert -1.0 < low < high < 1.0
            assert height < 0.5 * width or right - left > 1.0
        assert bar.locator("b").text_content() == "A & B; red line: the goal"
        page.get_by_role("button", name="Play").click()
        page.wait_for_function("() => viewer.animator.time > 0.8")
    assert errors == []


def test_nothing_is_left_for_another_thread_to_free(tmp_path, weight, scenes):
    """Garbage collection in another thread finds no Meshcat, which would end the process and this test."""
    write_replay(tmp_path / "replay.html", weight.settings.arm, scenes, title="")
    collector = threading.Thread(target=gc.collect)
    collector.start()
    collector.join()


def test_no_page_without_a_port(tmp_path, weight, scenes, monkeypatch):
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "package_map")
    with pytest.raises(AffordanceError, match=r"replay.html: cannot be drawn: .*DRAKE_ALLOW_NETWORK"):
        write_replay(tmp_path / "replay.html", weight.settings.arm, scenes, title="")
    assert not list(tmp_path.iterdir())


def read_recording(path):
    """The recording of a page: times and values of every property of every object, by path and property."""
    for chunk in re.findall("base64,([A-Za-z0-9+/=]+)", path.read_text(encoding="utf-8")):
        data = base64.b64decode(chunk)
        if b"set_animation" in data[:30]:
            return {
                (animation["path"], track["name"]): (
                    np.array([key["time"] for key in track["keys"]]) / animation["clip"]["fps"],
                    [key["value"] for key in track["keys"]],
                )
                for animation in msgpack.unpackb(data)["animations"]
                for track in animation["clip"]["tracks"]
            }
    raise AssertionError(f"{path} has no recording")


@pytest.fixture
def blows(scenes):
    """Scenes with a nail each that goes in by 12 mm within 10 ms, shown ten times slower."""
    nail = load_hammer(MODELS / "nail.yaml").nail
    return [
        scene._replace(
            placement=NailPlacement(nail, np.array([0.7 + 0.1 * k, 0.0, 1.3]), np.array([0.0, 0.0, -1.0])),
            travel=0.012 * (scene.times >= 0.11),
            slow=(0.1, 0.12, 50.0),
        )
        for k, scene in enumerate(scenes)
    ]


def test_recording_lasts_as_long_as_the_slowed_scenes_and_captions_say_so(tmp_path, weight, blows):
    path = tmp_path / "replay.html"
    write_replay(path, weight.settings.arm, blows, title="")
    page = path.read_text(encoding="utf-8")
    assert "red line" not in page
    # 20 of 200 ms are shown in 1 s; then there is a pause.
    assert "0.0 to 1.2 s: rod_10cm &lt;shown&gt; (50 × slower around the strike, 0.1 to 1.1 s)" in page
    assert "1.7 to 2.9 s: rod_15cm &lt;shown&gt; (50 × slower around the strike, 1.8 to 2.8 s)" in page
    recording = read_recording(path)
    assert max(times[-1] for times, _ in recording.values()) == pytest.approx(2 * (0.2 + 49 * 0.02 + 0.5), abs=0.07)
    assert 'src="http' not in page
    assert 1e6 < len(page) < 5e6


def test_nail_goes_in_between_rows_of_the_log(tmp_path, weight, blows):
    """The nail goes in during the half second of the replay that lies between two rows of the log."""
    path = tmp_path / "replay.html"
    write_replay(path, weight.settings.arm, blows, title="")
    times, places = read_recording(path)["/drake/arm/nail_0/nail_0", ".position"]
    height = np.interp(times, [0.0, 0.1, 0.6, 9.0], [0.0, 0.0, -0.012, -0.012])
    shown = np.array(places)[times < 1.6] - [0.7, 0.0, 1.3]
    np.testing.assert_allclose(shown[:, 2], height[times < 1.6], atol=0.012 * 1.01 / 15)  # a frame
    np.testing.assert_allclose(shown[:, :2], 0.0, atol=1e-9)


def test_nail_and_block_are_seen_in_their_own_scene_only(tmp_path, weight, blows, scenes):
    path = tmp_path / "replay.html"
    third = scenes[0]
    write_replay(path, weight.settings.arm, [*blows, third], title="")
    recording = read_recording(path)
    for k in range(2):
        for part in (f"nail_{k}", f"nail_{k}_block", f"tool_{k}"):
            times, seen = recording[f"/drake/arm/{part}", ".visible"]
            assert seen == [k == 0, k == 1, False]
            np.testing.assert_allclose(times, [0.0, 1.68, 3.36], atol=0.04)
    assert not any("nail_2" in name for name, _ in recording)


def test_camera_looks_closer_in_slow_motion_only(tmp_path, weight, blows, scenes):
    path = tmp_path / "replay.html"
    still = scenes[0]._replace(times=10 * scenes[0].times)
    write_replay(path, weight.settings.arm, [still, blows[0], still], title="")
    times, zoom = read_recording(path)["/Cameras/default/rotated/<object>", ".zoom"]
    zoom = np.array(zoom)
    np.testing.assert_array_equal(zoom[times < 2.49], 1.0)
    assert (zoom[(times > 2.64) & (times < 3.56)] == zoom.max()).all()
    assert zoom.max() > 2.0
    np.testing.assert_array_equal(zoom[times > 4.2], 1.0)


def test_page_without_slow_scenes_has_neither_nail_nor_zoom(tmp_path, weight, scenes):
    path = tmp_path / "replay.html"
    write_replay(path, weight.settings.arm, scenes, title="")
    names = {name for name, _ in read_recording(path)}
    assert not any("nail" in name or "Camera" in name for name in names)


@pytest.mark.parametrize("slow", [(0.1, 0.3, 20.0), (0.12, 0.1, 20.0), (0.1, 0.12, 0.5), (-0.1, 0.1, 2.0)])
def test_slow_motion_that_cannot_be_is_refused(tmp_path, weight, scenes, slow):
    with pytest.raises(ValueError, match=r"slow is .*, must be from 0 to 0.2 s, and at least 1 times slower"):
        write_replay(tmp_path / "replay.html", weight.settings.arm, [scenes[0]._replace(slow=slow)], title="")
