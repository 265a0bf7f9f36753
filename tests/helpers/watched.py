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

from playwright.sync_api import Page

from helpers.browser import find_browser, open_page
from helpers.children import PATIENCE, Start

# Extent of arm and object on the page, from -1 to 1: least and greatest to the right, and upwards.
EXTENT = """() => {
    const box = [1, -1, 1, -1];
    viewer.camera.updateMatrixWorld();
    viewer.scene_tree.find(["drake", "arm"]).object.traverseVisible(node => {
        if (!node.geometry) return;
        const points = node.geometry.attributes.position;
        for (let i = 0; i < points.count; i++) {
            const p = new MeshCat.THREE.Vector3().fromBufferAttribute(points, i);
            p.applyMatrix4(node.matrixWorld).project(viewer.camera);
            [box[0], box[1]] = [Math.min(box[0], p.x), Math.max(box[1], p.x)];
            [box[2], box[3]] = [Math.min(box[2], p.y), Math.max(box[3], p.y)];
        }
    });
    return box;
}"""
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
HEIGHT = f"() => {{{_TOOL} return height;}}"
RADIUS = f"() => {{{_TOOL} return radius;}}"
# Program with short holds; after the first one of Simulation I nothing happens unless somebody wants it to.
_BRIEFLY = """
import sys
from affordance.cli import main
from affordance.experiments import weight
from affordance.experiments.shared import experience
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
        page.goto(address)
        page.wait_for_function(f"() => ({HEIGHT})() > 0")

    def read(self, count: int) -> list[str]:
        """Reads the next lines that the process prints."""
        assert self._child.stdout is not None
        lines = [self._child.stdout.readline().strip() for _ in range(count)]
        self.lines += lines
        return lines

    def move(self, label: str, value: float) -> None:
        """Moves a slider, by its label, to a value."""
        slider = self.page.locator("#panel label", has_text=label).locator("input")
        slider.fill(f"{value:g}")

    def read_state(self) -> dict[str, Any]:
        """Reads what the page is told to show."""
        state: dict[str, Any] = self.page.evaluate("async () => (await fetch('/state')).json()")
        return state

    def read_rows(self) -> dict[str, str]:
        """Reads the lines of the panel, by their heading."""
        headings, pair = (
            "[...document.querySelectorAll('#panel dt')]",
            "[each.textContent, each.nextSibling.textContent]",
        )
        # In one call, since lines may change between two.
        rows: dict[str, str] = self.page.evaluate(f"() => Object.fromEntries({headings}.map(each => {pair}))")
        return rows

    def wait_for_row(self, name: str) -> str:
        """Waits until the panel has a line with a heading, and reads it."""
        find = f"[...document.querySelectorAll('#panel dt')].find(each => each.textContent === '{name}')"
        found: str = self.page.wait_for_function(
            f"() => {find}?.nextSibling.textContent", timeout=40000.0
        ).json_value()
        return found

    def check(self) -> None:
        """Asserts that the page reported no error, and asked nothing of another address."""
        assert self._errors == []
        assert {url for url in self._asked if not url.startswith((self._address, "data:", "blob:"))} == set()


@contextmanager
def watch(
    children: Start, *words: str | Path, briefly: bool = False, width: int = 1000, height: int = 600
) -> Iterator[Watched]:
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
    for _ in range(2):  # lines on other machines
        child.stdout.readline()
    with open_page(width, height) as page:
        watched = Watched(child, page, found.group())
        yield watched
        watched.check()
    os.killpg(child.pid, signal.SIGINT)
    _, err = child.communicate(timeout=PATIENCE)
    guard.cancel()
    assert (child.returncode, err) == (0, "")
