"""Checks the built site in a browser, before a release: links, widths and what a search finds.

``make release-check`` runs it; after ``make docs``, ``cd tests && python -m helpers.site_check`` does, too.
"""

import sys
from pathlib import Path
from urllib.parse import quote, unquote

from playwright.sync_api import Page

from helpers.browser import open_page

SITE = Path(__file__).parents[2] / "build" / "site"
# Width of a telephone, [pixels].
_NARROW = 420
# The first page that a search must find.
_FOUND = {
    "size-weight illusion": "docs/heaviness.html",
    "counterbalance": "docs/experiments.html",
    "Kalman": "docs/howto/own_learner.html",
    "sample size": "docs/experiments.html",
    "payload": "docs/identify.html",
    "wrong payload": "docs/howto/payload_on_controller.html",
}


def list_places(page: Page, path: Path) -> tuple[set[str], set[str]]:
    """Lists the files and places that a page links to, as addresses, and the places that it has."""
    page.goto(path.as_uri())
    links = page.evaluate("Array.from(document.querySelectorAll('a[href], img[src]'), each => each.href || each.src)")
    places = page.evaluate("Array.from(document.querySelectorAll('[id]'), each => each.id)")
    return {link for link in links if link.startswith("file:")}, {f"{path.as_uri()}#{place}" for place in places}


def search(page: Page, words: str) -> list[str]:
    """Lists the addresses that a search finds, the best first."""
    page.goto(f"{(SITE / 'search.html').as_uri()}?q={quote(words)}")
    page.wait_for_function("document.querySelector('#search-results .search-summary')?.textContent.includes('found')")
    return page.evaluate("Array.from(document.querySelectorAll('#search-results li a'), each => each.href)")


def main() -> int:
    """Prints what is wrong with the site; the exit status is 1 if something is."""
    problems, linked, present = [], {}, set()
    with open_page(_NARROW, 800) as page:
        for path in sorted(set(SITE.rglob("*.html")) - {SITE / "index.html"}):  # which leads to another page
            links, places = list_places(page, path)
            linked |= dict.fromkeys(links, path)
            present |= {path.as_uri(), *places}
            if (width := page.evaluate("document.documentElement.scrollWidth")) > _NARROW:
                problems.append(f"{path}: {width} pixels wide on a screen of {_NARROW}")
        for link, path in linked.items():
            target = link.rstrip("#")
            if target not in present and (
                "#" in target or not Path(unquote(target.removeprefix("file://"))).exists()
            ):
                problems.append(f"{path}: leads to {target}")
        for words, wanted in _FOUND.items():
            found = search(page, words)[:5]
            if not found or found[0].partition("#")[0] != (SITE / wanted).as_uri():
                problems.append(f"a search for {words!r} finds {', '.join(found)}; must find {wanted} first")
    print("\n".join(problems) or f"{len(list(SITE.rglob('*.html')))} pages: no problem was found")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
