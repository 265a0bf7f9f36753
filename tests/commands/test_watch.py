"""``affordance watch`` in a real browser, and its messages for bad input."""

import re
from contextlib import suppress

import numpy as np
import pytest
from helpers.robot_files import write_urdf
from helpers.trials import hold
from helpers.watched import HEIGHT, PANEL, RADIUS, watch
from playwright.sync_api import TimeoutError

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.commands.watch import _Show
from affordance.memory.ledger import open_memory
from affordance.reporting import live_scene
from affordance.reporting.live_scene import DENSITY, SIZE, LiveScene, Wish, trace_densities
from affordance.robots.importer import ImportOptions
from affordance.robots.kept import import_arm
from affordance.simulation.trial import TrialRunner

# Rate on the page: now, and least and greatest, in per cent of real time.
RATE = re.compile(r"(\d+) rtr% \(\d+-\d+\)")


def test_buttons_and_sliders_change_what_a_browser_shows(children, weight):
    """A slider's factor is that of the mass, cubed for the size, and the object on the page grows by it."""
    mass = weight.tools[0].mass
    with watch(children, "weight", briefly=True) as watched:
        page = watched.page
        watched.read(2)  # the hold is over
        assert watched.measure_panel() > 200  # though nothing moves, and nobody moves the camera
        before, height = page.evaluate(PANEL), page.evaluate(HEIGHT)
        radius = page.wait_for_function(f"() => Math.max(0, ({RADIUS})())").json_value()
        page.get_by_text("Decoy").click()
        page.wait_for_function(f"before => ({PANEL})() && ({PANEL})() != before", arg=before)
        page.wait_for_function(f"height => ({HEIGHT})() > 0 && ({HEIGHT})() != height", arg=height)
        for button in ("Next object", "Reset"):
            watched.read(2)  # the hold before it is over
            page.get_by_text(button).click()
        watched.read(2)
        assert watched.lines == [
            *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg"),
            *("decoy: rod 10cm, 0.04 kg", "felt: rod 10cm, 0.04 kg"),
            *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg") * 2,
        ]
        density = watched.move(DENSITY, 0.8)
        assert watched.read(2)[0] == f"held: rod 10cm, {density * mass:.2f} kg"
        size = watched.move(SIZE, 0.7)
        assert watched.read(2)[0] == f"held: rod 10cm, {density * size**3 * mass:.2f} kg"
        assert (density, size) == pytest.approx((1.6, 1.2), abs=0.1)
        page.wait_for_function(f"radius => Math.abs(({RADIUS})() - radius) < 1e-6 * radius", arg=size * radius)
        rates = [int(found[1]) for text in page.evaluate("() => drawn") if (found := RATE.match(text))]
    assert rates
    assert 20 < np.median(rates) < 150


def test_a_blow_shows_its_force(children):
    """Contact lasts a few milliseconds, which are shown slowly, so that an arrow comes in several pictures of a blow.

    The first blow may be over before the page is there.
    """
    with watch(children, "hammer", briefly=True) as watched:
        for _ in range(3):
            watched.page.keyboard.press("n")
            with suppress(TimeoutError):
                watched.page.wait_for_function("() => arrows.length > 1", timeout=40000.0)
                break
        arrows = watched.page.evaluate("() => arrows")
        assert len(arrows) > 1
        assert max(arrows) > 0.01


@pytest.mark.parametrize("name", ["com", "reach"])
def test_other_experiments_are_shown_with_a_bright_panel(children, name):
    """The arm is sent once: while objects and beliefs change, its first link remains the same object of the page."""
    with watch(children, name) as watched:
        links = "viewer.scene_tree.find(['drake', 'arm', 'arm']).object.children.map(link => link.uuid)"
        before = watched.page.evaluate(f"() => {links}")
        watched.page.keyboard.press("n")
        while not watched.read(1)[0].startswith("felt: "):
            pass
        assert watched.page.evaluate(f"() => {links}") == before
        assert watched.measure_panel() > 200


def find_peak(curve):
    """The density at which a line on the panel is highest, [kg/m^3]."""
    left, _, wide, _ = live_scene._AXES
    return (curve[curve[:, 1].argmax(), 0] - left) / wide * live_scene._DENSITY_MAX


def test_another_robot_begins_with_what_a_memory_believes(children, tmp_path, weight):
    """The line of the belief begins at a density of half the truth, to 0.1 %, and moves towards the truth."""
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
        # The first hold may have begun before the page was there, and a page that is slow misses lines.
        for _ in range(3):
            watched.page.keyboard.press("r")
            watched.read(2)
            first, *_, last = [lines for lines in watched.read_curves() if lines][-1]
            begun, ended = map(find_peak, (first, last))
            if begun == pytest.approx(remembered, rel=1e-3):
                break
        links = watched.page.evaluate("() => Object.keys(viewer.scene_tree.find(['drake', 'arm', 'arm']).children)")
    assert links == ["right_1", "right_2", "right_3", "right_4"]
    assert begun == pytest.approx(remembered, rel=1e-3)
    assert begun + 50.0 < ended < truth


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
    monkeypatch.setattr("affordance.reporting.live_scene.open_meshcat", lambda what: _Meshcat())
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


def test_objects_are_shown_in_turn_and_a_wish_chooses_the_next(monkeypatch, scene, weight):
    """After the last object comes the first. A decoy and a change show the same object again, a reset the first."""
    first, second, third = tools = weight.tools[:3]
    visit = [
        *((first, False, Wish.NEXT), (second, False, None), (third, False, Wish.NEXT), (first, False, Wish.NEXT)),
        *((second, False, Wish.CHANGE), (second, False, Wish.DECOY), (second, True, Wish.NEXT)),
        *((third, False, Wish.DECOY), (third, True, None), (first, False, Wish.NEXT), (second, False, Wish.RESET)),
        (first, False, None),
    ]
    show = _Show.__new__(_Show)
    show.tools, show.scene, show.task, show.start = tools, scene, None, MaterialMemory()
    shown = []

    def hold(tool, *, is_decoy):
        if len(shown) == len(visit):
            raise KeyboardInterrupt
        shown.append((tool, is_decoy))
        return visit[len(shown) - 1][-1]

    monkeypatch.setattr(show, "_hold", hold)
    monkeypatch.setattr(scene, "wait", lambda seconds: None)
    with pytest.raises(KeyboardInterrupt):
        show.run()
    assert [(tool.name, is_decoy) for tool, is_decoy in shown] == [
        (tool.name, is_decoy) for tool, is_decoy, _ in visit
    ]


def test_scaled_objects_weigh_as_their_volume_and_density(weight):
    tool = weight.tools[0]
    assert tool.scaled(0.5, 1.2).mass == pytest.approx(0.5 * 1.2**3 * tool.mass, rel=1e-12)
    np.testing.assert_allclose(tool.scaled(1.0, 1.2).p_TTcm, 1.2 * tool.p_TTcm, rtol=1e-12)


def test_curves_are_the_marginal_densities(weight):
    """The curve of a hardly truncated normal distribution is its density over the peak's, to 2 %."""
    memory = MaterialMemory.from_densities({"steel": 7850.0}).add_colours([], Prior())
    (curve,) = trace_densities(memory.belief)
    sd = float(np.sqrt(memory.belief.covariance[0, 0]))
    bell = np.exp(-0.5 * ((curve[:, 0] - 7850.0) / sd) ** 2)
    np.testing.assert_allclose(curve[:, 1], bell, atol=0.02)


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
