"""Builds HTML tables that show the main results in notebooks (``_repr_html_``)."""

from collections.abc import Sequence
from html import escape


def build_table(caption: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Builds an HTML table. All texts are escaped."""
    head = "".join(f"<th>{escape(title)}</th>" for title in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><tr>{head}</tr>{body}</table>"
