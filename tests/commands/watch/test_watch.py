"""``affordance watch`` in a real browser, and its messages for bad input."""

import ipaddress
import re
import sys
from urllib.parse import urlsplit

import numpy as np
import pytest
from helpers.robot_files import write_urdf
from helpers.trials import hold
from helpers.watched import EXTENT, HEIGHT, RADIUS, watch

from affordance.belief.material_memory import MaterialMemory
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.watch.live_scene import LiveScene, Wish
from affordance.extensions.watch.show import Show
from affordance.reporting.replay import open_meshcat
from affordance.simulation.trial import TrialRunner


def test_buttons_and_sliders_change_what_a_browser_shows(children, weight):
    """A slider's factor is that of the mass, cubed for the size, and the object on the page grows by it."""
    mass = weight.tools[0].mass
    with watch(children, "weight", briefly=True) as watched:
        page = watched.page
        watched.read(2)  # the hold is over
        radius = page.wait_for_function(f"() => Math.max(0, ({RADIUS})())").json_value()
        page.wait_for_function("() => document.querySelector('#panel dl').textContent.includes('Surprise')")
        rows = watched.read_rows()
        assert list(rows) == ["True mass", "Expected", "After feeling", "Moved", "Surprise"]
        assert rows["True mass"] == f"{mass:.2f} kg"
        assert page.locator("#panel h1").text_content() == "Held: rod 10cm"
        assert "brass" in page.locator("#legend").text_content()
        assert page.locator("#panel polygon").count() == page.locator("#panel polyline").count() == 2
        height = page.evaluate(HEIGHT)
        page.get_by_role("button", name="Decoy").click()
        page.wait_for_function(f"height => ({HEIGHT})() > 0 && ({HEIGHT})() != height", arg=height)
        for button in ("Next object", "Reset"):
            watched.read(2)  # the hold before it is over
            page.get_by_role("button", name=button).click()
        watched.read(2)
        assert watched.lines == [
            *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg"),
            *("decoy: rod 10cm, 0.04 kg", "felt: rod 10cm, 0.04 kg"),
            *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg") * 2,
        ]
        watched.move("Density", 1.6)
        assert watched.read(2)[0] == f"held: rod 10cm, {1.6 * mass:.2f} kg"
        watched.move("Size", 1.2)
        assert watched.read(2)[0] == f"held: rod 10cm, {1.6 * 1.2**3 * mass:.2f} kg"
        page.wait_for_function(f"radius => Math.abs(({RADIUS})() - radius) < 1e-6 * radius", arg=1.2 * radius)
        page.reload()  # a page that is opened later shows the sliders as they stand
        page.wait_for_function("() => document.querySelector('input[name^=Size]').value == '1.2'")


@pytest.mark.parametrize(("width", "height"), [(1200, 700), (420, 750)])
def test_arm_fills_the_scene_beside_or_above_the_panel(children, width, height):
    """Buttons and sliders are seen at once, the arm wholly, in more than half of the scene's width."""
    with watch(children, "weight", briefly=True, width=width, height=height) as watched:
        watched.read(2)
        watched.page.locator("#panel dd").nth(3).wait_for()
        left, right, low, high = watched.page.evaluate(EXTENT)
        assert -1.0 < left < right < 1.0
        assert -1.0 < low < high < 1.0
        assert right - left > 1.0  # of 2; the longest object is twice as long as the one that is held
        scene = watched.page.locator("#meshcat-pane").bounding_box()
        for control in [*watched.page.locator("#panel button").all(), *watched.page.locator("#panel input").all()]:
            box = control.bounding_box()
            assert 0.0 <= box["x"] < box["x"] + box["width"] <= width
            assert 0.0 <= box["y"] < box["y"] + box["height"] <= height
            assert box["x"] >= scene["x"] + scene["width"] or box["y"] >= scene["y"] + scene["height"]
        assert watched.page.evaluate("() => document.documentElement.scrollWidth") == width


@pytest.mark.parametrize("name", ["com", "reach", "hammer"])
def test_other_experiments_are_shown(children, name):
    with watch(children, name, briefly=True) as watched:
        watched.page.keyboard.press("n")
        while not watched.read(1)[0].startswith("felt: "):
            pass
        if name != "com":
            pattern = r"(right|wrong): by (wood|steel) [\d.]+ J, by (wood|steel) [\d.]+ J"
            assert re.fullmatch(pattern, watched.wait_for_row("Grip"))


def test_a_hold_that_a_wish_ends_is_not_remembered(children, tmp_path):
    path = tmp_path / "memory.sqlite"
    with watch(children, "weight", "--memory", path) as watched:
        watched.read(2)  # the first of several
        assert watched.read(1)[0].startswith("held: ")
        watched.page.keyboard.press("n")
        while not watched.read(1)[0].startswith("held: "):  # a slow machine's wish may come after the hold
            pass
    num_felt = sum(line.startswith("felt: ") for line in watched.lines)
    assert num_felt >= 1
    with open_memory(path) as ledger:
        assert len(ledger) == num_felt


def find_peak(chart, *, is_filled):
    """The density at which a curve of a chart is highest, [kg/m^3]."""
    (points,) = (np.array(points) for points, _, filled in chart["curves"] if filled == is_filled)
    (share, text) = chart["ticks"][1]
    return 1000.0 * float(text) * points[points[:, 1].argmax(), 0] / share


def test_another_robot_begins_with_what_a_memory_believes(children, tmp_path, weight):
    """The belief begins at a density of half the truth, to 0.1 %, and moves towards the truth."""
    (part,) = weight.tools[0].components
    truth = part.material.density
    robot, path = tmp_path / "robot", tmp_path / "memory.sqlite"
    import_arm(write_urdf(tmp_path), ImportOptions("right_tool"), robot, with_meshes=False, fits_tasks=False)
    with open_memory(path) as ledger:
        ledger.append([hold("bar", (part.looks_like.colour,), (0.5 * truth,), 1)])
        ((remembered,),) = ledger.recall().belief.compute_percentiles([0.5])
    assert remembered == pytest.approx(0.5 * truth, rel=0.05)
    with watch(children, "weight", "--robot", robot, "--memory", path, briefly=True) as watched:
        watched.read(2)
        chart = watched.read_state()["densities"]
        links = watched.page.evaluate("() => Object.keys(viewer.scene_tree.find(['drake', 'arm', 'arm']).children)")
    assert links == ["right_1", "right_2", "right_3", "right_4"]
    begun = find_peak(chart, is_filled=True)
    assert begun == pytest.approx(remembered, rel=1e-3)
    assert begun + 50.0 < find_peak(chart, is_filled=False) < truth


class _Meshcat:
    """Meshcat that a visitor operates."""

    def __init__(self):
        self.clicks = dict.fromkeys((wish.value for wish in Wish), 0)
        self.factors = {}

    def GetButtonClicks(self, name):
        return self.clicks[name]

    def GetSliderValue(self, name):
        return self.factors.get(name, 1.0)

    def __getattr__(self, name):
        return lambda *arguments: None


@pytest.fixture
def scene(monkeypatch, weight):
    monkeypatch.setattr("affordance.extensions.watch.live_scene.open_meshcat", lambda what: _Meshcat())
    return LiveScene(weight.settings.arm, {})


def test_wishes_are_taken_once(scene):
    assert scene.take_wish() is None
    scene.meshcat.clicks["Decoy"] += 1
    assert scene.is_wanted
    assert scene.take_wish() is Wish.DECOY
    scene.meshcat.factors["Size, times"] = 1.2
    assert scene.take_wish() is Wish.CHANGE
    assert scene.factors == (1.0, 1.2)
    assert scene.take_wish() is None


@pytest.mark.parametrize(("sent", "used"), [(1e9, 1.5), (-1.0, 0.5), (float("nan"), 1.0)])
def test_slider_values_out_of_range_are_replaced(scene, sent, used):
    scene.meshcat.factors["Size, times"] = sent
    assert scene.factors == (1.0, used)
    scene.take_wish()
    assert not scene.is_wanted


@pytest.mark.skipif(sys.platform == "darwin", reason="has a single local address")
def test_no_website_can_guess_where_the_scene_listens():
    """A browser lets any website send messages to a known local port, and a broken one ends Meshcat's process."""
    addresses = [urlsplit(open_meshcat("a test").web_url()) for _ in range(3)]
    assert len({each.hostname for each in addresses}) == 3
    assert len({each.port for each in addresses}) > 1
    for each in addresses:
        assert ipaddress.ip_address(each.hostname).is_loopback
        assert each.port > 10_000


def test_objects_are_shown_in_turn_and_a_wish_chooses_the_next(monkeypatch, scene, weight):
    """After the last object comes the first. A decoy and a change show the same object again, a reset the first."""
    first, second, third = tools = weight.tools[:3]
    visit = [
        *((first, False, Wish.NEXT), (second, False, None), (third, False, Wish.NEXT), (first, False, Wish.NEXT)),
        *((second, False, Wish.CHANGE), (second, False, Wish.DECOY), (second, True, Wish.NEXT)),
        *((third, False, Wish.DECOY), (third, True, None), (first, False, Wish.NEXT), (second, False, Wish.RESET)),
        (first, False, None),
    ]
    show = Show.__new__(Show)
    show._tools, show.scene, show._task, show._start = tools, scene, None, MaterialMemory()
    shown = []

    def hold(tool, *, is_decoy):
        if len(shown) == len(visit):
            raise KeyboardInterrupt
        shown.append((tool, is_decoy))
        return visit[len(shown) - 1][-1]

    monkeypatch.setattr(show, "_hold", hold)
    monkeypatch.setattr(scene, "wait", lambda seconds: None)
    monkeypatch.setattr(scene, "tell", lambda *_, **__: None)
    with pytest.raises(KeyboardInterrupt):
        show.run()
    assert [(tool.name, is_decoy) for tool, is_decoy in shown] == [
        (tool.name, is_decoy) for tool, is_decoy, _ in visit
    ]


def test_scaled_objects_weigh_as_their_volume_and_density(weight):
    tool = weight.tools[0]
    assert tool.scaled(0.5, 1.2).mass == pytest.approx(0.5 * 1.2**3 * tool.mass, rel=1e-12)
    np.testing.assert_allclose(tool.scaled(1.0, 1.2).p_TTcm, 1.2 * tool.p_TTcm, rtol=1e-12)


def test_an_observer_learns_the_same_while_it_is_watched(weight):
    """Torques of a hold of 0.2 s are the same to the last bit with and without a display in the Diagram."""
    seen = []

    def display(builder, plant, posterior):
        seen.append(plant.geometry_source_is_registered())

    tool = weight.tools[0]
    records = [
        TrialRunner(weight.settings, display=each).run_hold(tool, MaterialMemory(), duration=0.2)
        for each in (None, display)
    ]
    assert seen == [False]
    np.testing.assert_array_equal(records[0].tau, records[1].tau)
