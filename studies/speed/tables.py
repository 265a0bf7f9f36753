"""Tables in Markdown."""

from collections.abc import Sequence


def format_row(row: Sequence[str]) -> str:
    """Lays out one row of text."""
    return "| " + " | ".join(row) + " |"


def format_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lays out rows of text as a Markdown table."""
    return "\n".join(format_row(row) for row in (header, ["---"] * len(header), *rows))
