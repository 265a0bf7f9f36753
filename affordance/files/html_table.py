"""Builds HTML tables for notebooks, for ``_repr_html_`` of the main results."""

from collections.abc import Sequence
from html import escape


def build_table(caption: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Builds an HTML table in which all texts are escaped."""
    head = "".join(f"<th>{escape(title)}</th>" for title in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><tr>{head}</tr>{body}</table>"
