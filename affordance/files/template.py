"""Rendering of the program's own templates, which lie in the folder ``templates`` of a package."""

from collections.abc import Callable, Mapping
from typing import Any


def render_template(
    package: str, name: str, *, escapes: bool, filters: Mapping[str, Callable[..., str]] | None = None, **values: Any
) -> str:
    """Renders a template of a package, with filters and values by name, which may be escaped for HTML."""
    import jinja2  # here, as most runs render nothing

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        undefined=jinja2.StrictUndefined,
        autoescape=escapes,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(filters or {})
    return environment.get_template(name).render(values)
