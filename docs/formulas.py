"""Formulas as MathML, which browsers draw by themselves."""

from typing import Any

from latex2mathml.converter import convert


def add_formulas(app: Any) -> None:
    """Adds a renderer of formulas to Sphinx."""
    app.add_html_math_renderer("mathml", (_show_inline, None), (_show_block, None))


def _show_inline(writer: Any, node: Any) -> None:
    writer.body.append(convert(node.astext(), display="inline"))
    _skip()


def _show_block(writer: Any, node: Any) -> None:
    writer.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    _skip()


def _skip() -> None:
    from docutils.nodes import SkipNode  # part of Sphinx

    raise SkipNode
