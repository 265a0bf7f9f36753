"""Renders the program's templates, which are stored in the folder ``templates`` of a package."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

type _Filters = tuple[tuple[str, Callable[..., str]], ...]


def render_template(
    package: str, name: str, *, escapes: bool, filters: Mapping[str, Callable[..., str]] | None = None, **values: Any
) -> str:
    """Renders a template of a package. ``escapes`` is True to escape values for HTML."""
    environment = _build_environment(package, escapes, tuple((filters or {}).items()))
    found: str = environment.get_template(name).render(values)
    return found


@lru_cache
def _build_environment(package: str, escapes: bool, filters: _Filters) -> Any:
    """Builds the environment of a package's templates, which caches compiled templates."""
    import jinja2  # imported here because most runs render nothing

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        undefined=jinja2.StrictUndefined,
        autoescape=escapes,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(filters)
    return environment
