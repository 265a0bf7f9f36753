"""Headless browser in which tests load pages; a missing one fails where required, and elsewhere skips the test."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Page, sync_playwright

_NAMES = ("chromium", "chromium-browser", "google-chrome")
_HINT = "no browser was found; as root: apt-get install chromium (or AFFORDANCE_BROWSER names one like it)"
# WebGL is computed by software; nothing is asked of the network.
_OPTIONS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)


def find_browser() -> str:
    """Finds the browser's program; skips the test, or fails it if AFFORDANCE_BROWSER_TEST is 'required'."""
    named = os.environ.get("AFFORDANCE_BROWSER")
    found = named or next((path for name in _NAMES if (path := shutil.which(name))), None)
    if found is None:
        (pytest.fail if os.environ.get("AFFORDANCE_BROWSER_TEST") == "required" else pytest.skip)(_HINT)
    return found


@contextmanager
def open_page(width: int = 600, height: int = 400) -> Iterator[Page]:
    """Opens an empty page in a browser of its own."""
    program = find_browser()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(_OPTIONS))
        try:
            yield browser.new_page(viewport={"width": width, "height": height})
        finally:
            browser.close()
