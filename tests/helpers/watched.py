"""``affordance watch`` in a process of its own, with its page in a browser that notes what is shown."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Page

from affordance.arrays import Array
from helpers.browser import find_browser, open_page
from helpers.children import PATIENCE, Start

# Before the page: texts that are drawn on a visible canvas are noted, as that of the rate.
_NOTE_TEXTS = """
    window.drawn = [];
    const fillText = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function(text, ...others) {
        if (this.canvas.getClientRects().length) window.drawn.push(text);
        return fillText.call(this, text, ...others);
    };
"""
# Once the page is there: lines of the belief, a list for each announcement, and heights of visible arrows, [m].
_NOTE_SCENE = """() => {
    window.curves = [[]];
    window.arrows = [];
    window.place = node => {
        const points = Array.from(node.geometry.attributes.position.array), placed = [];
        for (let i = 0; i < points.length; i += 3) {
            const point = new MeshCat.THREE.Vector3(...points.slice(i, i + 3));
            placed.push(...point.applyMatrix4(node.matrixWorld).toArray());
        }
        return placed;
    };
    const obey = viewer.handle_command.bind(viewer);
    viewer.handle_command = command => {
        obey(command);
        const path = command.path || "";
        if (command.type == "delete" && path == "/drake/now") window.curves.push([]);
        if (command.type == "set_object" && path == "/drake/now/0") {
            const line = viewer.scene_tree.find(["drake", "now", "0", "<object>"]).object;
            line.updateWorldMatrix(true, false);
            window.curves.at(-1).push(window.place(line));
        }
        if (path.startsWith("/drake/contact/point/tool+nail")) {
            const arrow = viewer.scene_tree.find(["drake", "contact", "point", "tool+nail"]).object;
            const box = new MeshCat.THREE.Box3().setFromObject(arrow);
            if (arrow.visible && !box.isEmpty()) window.arrows.push(box.max.y - box.min.y);
        }
    };
}"""
# Identity of the panel that the page shows, or "" while there is none.
_PANEL = """
    let panel = "";
    viewer.scene_tree.find(["drake", "panel"]).object.traverse(node => {
        if (node.geometry) panel = node.geometry.uuid;
    });
    return panel;
"""
# Corners of the panel, three numbers each, [m].
_CORNERS = """() => {
    let corners = [];
    viewer.scene_tree.find(["drake", "panel"]).object.traverse(node => {
        if (node.geometry) corners = window.place(node);
    });
    return corners;
}"""
# Middle of the panel on the page, from -1 to 1 to the right and upwards.
_MIDDLE = f"""() => {{
    const p = ({_CORNERS})(), n = p.length / 3, middle = new MeshCat.THREE.Vector3();
    for (let i = 0; i < p.length; i += 3) middle.add(new MeshCat.THREE.Vector3(...p.slice(i, i + 3)));
    return middle.divideScalar(n).project(viewer.camera).toArray().slice(0, 2);
}}"""
# Height of the object in the hand and radius of the sphere around it, [m]; -1 while there is none.
_TOOL = """
    let height = -1, radius = -1;
    viewer.scene_tree.find(["drake", "arm", "tool"]).object.traverse(node => {
        if (!node.geometry) return;
        node.geometry.computeBoundingSphere();
        height = node.matrixWorld.elements[13];
        radius = node.geometry.boundingSphere.radius * node.matrixWorld.getMaxScaleOnAxis();
    });
"""
PANEL = f"() => {{{_PANEL}}}"
HEIGHT = f"() => {{{_TOOL} return height;}}"
RADIUS = f"() => {{{_TOOL} return radius;}}"
# Program with short holds; after the first one of Simulation I nothing happens unless somebody wants it to.
_BRIEFLY = """
import sys
from affordance.cli import main
from affordance.experiments import experience, weight
weight.DURATION = experience.DURATION = 0.5
read = weight.read
weight.read = lambda setup: read(setup)[:1]
sys.exit(main(sys.argv[1:]))
"""


class Watched:
    """Process whose page a visitor has open."""

    def __init__(self, child: subprocess.Popen[str], page: Page, address: str) -> None:
        """Opens the page, and notes its messages, requests and what it shows."""
        self.page = page
        self.lines: list[str] = []
        self._child = child
        self._address = address
        self._errors: list[str] = []
        self._asked: list[str] = []
        page.set_default_timeout(1000.0 * PATIENCE)
        page.on("console", lambda message: self._errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: self._errors.append(str(error)))
        page.on("request", lambda request: self._asked.append(request.url))
        page.add_init_script(_NOTE_TEXTS)
        page.goto(address)
        page.evaluate(_NOTE_SCENE)
        page.wait_for_function(f"() => ({PANEL})() && ({HEIGHT})() > 0")
        page.get_by_text("Open Controls").click()

    def read(self, count: int) -> list[str]:
        """Reads the next lines that the process prints."""
        assert self._child.stdout is not None
        lines = [self._child.stdout.readline().strip() for _ in range(count)]
        self.lines += lines
        return lines

    def move(self, label: str, share: float) -> float:
        """Moves a slider to a share of its length; returns the value that the page then shows for it."""
        row = self.page.locator("li.has-slider", has_text=label)
        box = row.locator(".slider").bounding_box()
        assert box is not None
        row.locator(".slider").click(position={"x": share * box["width"], "y": box["height"] / 2})
        return float(row.locator("input").input_value())

    def measure_panel(self) -> float:
        """Measures the median brightness, 0 to 255, of the page where the middle of the panel is."""
        self.page.wait_for_timeout(700.0)
        shot = cv2.imdecode(np.frombuffer(self.page.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
        assert shot is not None
        x, y = self.page.evaluate(_MIDDLE)
        height, width = shot.shape
        row, column = int(0.5 * (1.0 - y) * height), int(0.5 * (1.0 + x) * width)
        return float(np.median(shot[row - 20 : row + 20, column - 20 : column + 20]))

    def read_curves(self) -> list[list[Array]]:
        """Reads the lines of the belief, by announcement, as shares of the panel's width and height, (N, 2) each."""
        corners = np.reshape(self.page.evaluate(_CORNERS), (-1, 3))
        low, right, up = corners[0], corners[1] - corners[0], corners[2] - corners[1]
        edges = np.array([right / (right @ right), up / (up @ up)])
        noted: list[list[Any]] = self.page.evaluate("() => window.curves")
        return [[(np.reshape(line, (-1, 3)) - low) @ edges.T for line in lines] for lines in noted]

    def check(self) -> None:
        """Asserts that the page reported no error, and asked nothing of another address."""
        assert self._errors == []
        assert {url for url in self._asked if not url.startswith((self._address, "data:", "blob:"))} == set()


@contextmanager
def watch(children: Start, *words: str | Path, briefly: bool = False) -> Iterator[Watched]:
    """Starts the command with arguments and opens its page; at the end it is interrupted, and must be content."""
    find_browser()
    program = ["-c", _BRIEFLY] if briefly else ["-m", "affordance"]
    command = [sys.executable, *program, "watch", *map(str, words)]
    child = children(command, env={**os.environ, "DISPLAY": ""})
    guard = threading.Timer(PATIENCE, child.kill)  # kills the child, whose output would otherwise be awaited for ever
    guard.daemon = True
    guard.start()
    assert child.stdout is not None
    found = None
    while found is None:
        line = child.stdout.readline()
        assert line, child.communicate()
        found = re.search(r"http://localhost:\d+", line)
    with open_page() as page:
        watched = Watched(child, page, found.group())
        yield watched
        watched.check()
    os.killpg(child.pid, signal.SIGINT)
    _, err = child.communicate(timeout=PATIENCE)
    guard.cancel()
    assert (child.returncode, err) == (0, "")
