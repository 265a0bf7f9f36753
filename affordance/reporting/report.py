"""The page that puts our figures beside the paper's claims, each claim met or not, with the number.

Every experiment writes its section; the page is made of the sections a folder holds, in the paper's order.
"""

import base64
import html
import json
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from affordance.files.atomic import quarantine, write_json, write_text

_LOG = logging.getLogger(__name__)
_SECTION = "section.json"
_STYLE = """
body { font: 16px/1.55 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #1a1a1a }
h1 { font-size: 1.7rem } h2 { margin-top: 3rem; border-top: 1px solid #ccc; padding-top: 1.5rem }
figure { margin: 1.5rem 0 } figure img { max-width: 100%; max-height: 32rem }
figcaption { color: #444; font-size: 0.92rem }
table { border-collapse: collapse; width: 100% }
td, th { text-align: left; vertical-align: top; padding: 0.45rem 0.8rem; border-bottom: 1px solid #ddd }
td.verdict { white-space: nowrap; font-weight: 600 }
.met { color: #00664c } .not { color: #a33c00 } blockquote { margin: 0; color: #333 }
"""


class Claim(NamedTuple):
    """Something the paper says, or we ask of ourselves, and what was found.

    Attributes:
        source: Where it is said.
        text: What is said.
        met: Whether our numbers agree.
        found: The numbers, in words.
    """

    source: str
    text: str
    met: bool
    found: str


class Picture(NamedTuple):
    """A figure of the report.

    Attributes:
        file: Its name in the experiment's folder.
        caption: What it shows.
    """

    file: str
    caption: str


class Section(NamedTuple):
    """What an experiment reports.

    Attributes:
        order: Place among the sections.
        title: Heading.
        summary: What was done, in a few sentences.
        pictures: Figures in order.
        claims: What the paper says and what was found.
        differences: Where we differ from the paper, and why; empty if nowhere.
    """

    order: int
    title: str
    summary: str
    pictures: Sequence[Picture]
    claims: Sequence[Claim]
    differences: Sequence[str]


def write_section(folder: Path, section: Section) -> None:
    """Keeps an experiment's section beside its figures."""
    content = section._asdict()
    content["pictures"] = [picture._asdict() for picture in section.pictures]
    content["claims"] = [claim._asdict() for claim in section.claims]
    write_json(folder / _SECTION, content)


def remove_section(folder: Path) -> None:
    """Takes a section that no longer holds out of the report, if there is one."""
    (folder / _SECTION).unlink(missing_ok=True)


def write_report(folder: Path) -> Path:
    """Writes FOLDER/report.html from the sections in its subfolders.

    A section that is not one is named and set aside; one whose figures cannot be read is named and left out.

    Returns: The page's path.
    """
    rendered = []
    for path in folder.glob(f"*/{_SECTION}"):
        try:
            section = _read_section(path)
            rendered.append((section.order, _render_section(section, path.parent)))
        except OSError as error:
            _LOG.warning("%s is left out of the report: it cannot be read (%s)", path, error)
        except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
            quarantine(path, f"is left out of the report: it is not a section ({error})")
    body = "\n".join(text for _, text in sorted(rendered))
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>Visual inertial affordances</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n<h1>Visual inertial affordances: the paper and what we find</h1>\n"
        "<p>One noise model, one prior, one arm and one controller serve every simulation; their constants "
        "come from sources and were fixed before any outcome was looked at, but for the place of the grip "
        "(docs/decisions/0002-arm.md), the goal of a hold (0010), the rate of sampling (0008), where the nail stands "
        "(0014), what the eye takes for straight (0015) and a margin to limits of angle (0009); none of these was "
        "changed to meet a claim of the paper, but without the margin limits of angle are not kept under every fault."
        f"</p>\n{body}\n</body>\n</html>\n"
    )
    path = folder / "report.html"
    write_text(path, page)
    return path


def _read_section(path: Path) -> Section:
    content = json.loads(path.read_text(encoding="utf-8"))
    content["pictures"] = [Picture(**picture) for picture in content["pictures"]]
    content["claims"] = [Claim(**claim) for claim in content["claims"]]
    section = Section(**content)
    if not isinstance(section.order, int):
        raise TypeError(f"its order is {section.order!r}")
    for picture in section.pictures:
        if Path(picture.file).name != picture.file:
            raise ValueError(f"its picture {picture.file!r} lies elsewhere")
    return section


def _render_section(section: Section, home: Path) -> str:
    pictures = "\n".join(_render_picture(picture, home) for picture in section.pictures)
    rows = "\n".join(
        f"<tr><td>{html.escape(claim.source)}</td><td><blockquote>{html.escape(claim.text)}</blockquote></td>"
        f'<td class="verdict {"met" if claim.met else "not"}">{"met" if claim.met else "not met"}</td>'
        f"<td>{html.escape(claim.found)}</td></tr>"
        for claim in section.claims
    )
    differences = "".join(f"<li>{html.escape(text)}</li>" for text in section.differences)
    return (
        f"<h2>{html.escape(section.title)}</h2>\n<p>{html.escape(section.summary)}</p>\n{pictures}\n"
        f"<table><tr><th>said in</th><th>claim</th><th>here</th><th>found</th></tr>\n{rows}</table>\n"
        + (f"<h3>Where we differ from the paper</h3>\n<ul>{differences}</ul>\n" if differences else "")
        + _render_links(home)
    )


def _render_links(home: Path) -> str:
    """Where there is more of an experiment."""
    more = {
        "replay.html": "the arm in motion",
        "metrics.json": "all numbers",
        "diagram.svg": "the diagram that was run",
    }
    links = [f'<a href="{home.name}/{file}">{text}</a>' for file, text in more.items() if (home / file).exists()]
    return f"<p>More: {', '.join(links)}.</p>" if links else ""


def _render_picture(picture: Picture, home: Path) -> str:
    """A figure, carried inside the page."""
    content = base64.b64encode((home / picture.file).read_bytes()).decode("ascii")
    kind = "svg+xml" if picture.file.endswith(".svg") else "png"
    caption = html.escape(picture.caption)
    return (
        f'<figure><img src="data:image/{kind};base64,{content}" alt="{caption}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
