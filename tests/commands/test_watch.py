"""``affordance watch`` in a real browser, and its messages for bad input."""

import os
import re
import signal
import sys
import threading

import numpy as np
import pytest
from helpers.browser import find_browser, open_page
from helpers.children import PATIENCE

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.reporting.live_scene import LiveScene, Wish, trace_densities
from affordance.simulation.trial import TrialRunner

# One short hold, after which nothing happens unless somebody wants it to.
PROTOCOL = """
name: patience
question: Does anything happen without a click?
objects: {file: tools/weight.yaml, groups: {first: {from: 1, to: 1}}}
blocks:
  - name: lifts
    objects: first
    do: {hold: {duration: 0.5}}
numbers:
  drop_m: {measure: drop}
"""
# Identity of the panel that the page shows, or "" while there is none, and height of the object in the hand, [m].
PANEL = """() => {
    let panel = "";
    viewer.scene_tree.find(["drake", "panel"]).object.traverse(node => {
        if (node.geometry) panel = node.geometry.uuid;
    });
    return panel;
}"""
HEIGHT = """() => {
    let height = -1;
    viewer.scene_tree.find(["drake", "arm", "tool"]).object.traverse(node => {
        if (node.geometry) height = node.matrixWorld.elements[13];
    });
    return height;
}"""


def test_a_button_changes_what_a_browser_shows(children, tmp_path):
    find_browser()
    path = tmp_path / "patience.yaml"
    path.write_text(PROTOCOL)
    child = children([sys.executable, "-m", "affordance", "watch", str(path)], env={**os.environ, "DISPLAY": ""})
    guard = threading.Timer(PATIENCE, child.kill)  # kills the child, whose output would otherwise be awaited for ever
    guard.daemon = True
    guard.start()
    lines = [child.stdout.readline() for _ in range(3)]  # the hold is over
    address = re.search(r"http://localhost:\d+", lines[0])
    assert address, child.communicate()
    said, asked = [], []
    with open_page() as page:
        page.set_default_timeout(1000.0 * PATIENCE)
        page.on("console", lambda message: said.append((message.type, message.text)))
        page.on("pageerror", lambda error: said.append(("error", str(error))))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(address.group())
        page.wait_for_function(f"() => ({PANEL})() && ({HEIGHT})() > 0")
        before, height = page.evaluate(PANEL), page.evaluate(HEIGHT)
        page.get_by_text("Open Controls").click()
        page.get_by_text("Decoy").click()
        page.wait_for_function(f"before => ({PANEL})() && ({PANEL})() != before", arg=before)
        page.wait_for_function(f"height => ({HEIGHT})() != height", arg=height)
        for button in ("Next object", "Reset"):
            lines += [child.stdout.readline() for _ in range(2)]  # the hold before it is over
            page.get_by_text(button).click()
    assert [each for each in said if each[0] == "error"] == []
    assert {url for url in asked if not url.startswith((address.group(), "data:", "blob:"))} == set()
    lines += [child.stdout.readline() for _ in range(2)]
    os.killpg(child.pid, signal.SIGINT)
    _, err = child.communicate(timeout=PATIENCE)
    guard.cancel()
    assert (child.returncode, err) == (0, "")
    assert [line.strip() for line in lines[1:]] == [
        *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg"),
        *("decoy: rod 10cm, 0.04 kg", "felt: rod 10cm, 0.04 kg"),
        *("held: rod 10cm, 0.40 kg", "felt: rod 10cm, 0.40 kg") * 2,
    ]


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
