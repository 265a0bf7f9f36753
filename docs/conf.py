"""Documentation site: ``make docs`` builds it in build/site from the pages as they stand in the repository.

The repository is the source folder, so that every relative link works on a git host and in the site alike.
"""

import functools
import hashlib
import operator
import os
import re
import sys
import types
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from nbclient import NotebookClient  # noqa: E402

from affordance import MODELS, __version__  # noqa: E402
from docs.formulas import add_formulas  # noqa: E402
from docs.generated import describe_class, fill_marks, link_documents, list_classes  # noqa: E402

project = "Visual inertial affordances"
author = copyright = "The developers of visual inertial affordances"
version = release = __version__
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**", "models/README.md", "affordance/tutorials/*.ipynb"]
exclude_patterns = [".*", "build", "results", "tests", "studies", "*.egg-info", "**/__pycache__", "docs/images"]
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]

smartquotes = False  # two hyphens begin an option
html_theme = "furo"
html_title = f"{project} {__version__}"
html_copy_source = False
html_static_path = ["theme"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"  # of the browser itself: formulas need no network

myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "attrs_inline"]
myst_heading_anchors = 4

autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autoclass_content = "both"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 140
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True
napoleon_use_ivar = True
napoleon_custom_sections = [("Input ports", "params_style"), ("Output ports", "params_style")]


def _hash_program() -> str:
    """Hashes what decides what pages of pictures show: program, models and versions of libraries."""
    digest = hashlib.sha256((ROOT / "constraints.txt").read_bytes())
    for folder in ("affordance", "models"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".yaml", ".sdf", ".csv", ".jsonl", ".obj", ".j2"):
                digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


# Pages of pictures are executed; what they show is kept until the program changes; lessons have their outputs.
nb_execution_mode = "cache"
nb_execution_excludepatterns = ["*.ipynb"]
nb_execution_cache_path = str(ROOT / "build" / "docs_cache" / _hash_program())
nb_execution_in_temp = True
nb_execution_timeout = -1  # none by the clock: a loaded machine is slow
nb_execution_raise_on_error = True
# A loaded machine starts slowly and prints late, [s].
NotebookClient.__init__ = functools.partialmethod(NotebookClient.__init__, startup_timeout=600, iopub_timeout=600)
# Commands of pages are those of this environment.
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])


def fill_page(app: Any, name: str, source: list[str]) -> None:
    """Fills what is generated into a page, and points links to folders to a page or to nothing."""
    path = Path(app.env.doc2path(name))
    text = fill_marks(source[0])

    def follow(link: re.Match[str]) -> str:
        target = path.parent / link["target"]
        if not target.is_dir():
            return link[0]
        index = next((each for each in ("index.md", "README.md") if (target / each).is_file()), None)
        return f"[{link['text']}]({link['target']}/{index})" if index else link["text"]

    source[0] = re.sub(r"\[(?P<text>[^\]\[]*)\]\((?P<target>[^():#]+)\)", follow, text)


def write_entrance(app: Any) -> None:
    """Writes the page at the top of the site, which leads to the pages' index, before anything can fail."""
    page = '<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url=docs/index.html">'
    link = f'<a href="docs/index.html">{project}</a>'
    (Path(app.outdir) / "index.html").write_text(f"{page}<title>{project}</title>{link}\n", encoding="utf-8")


def write_classes(app: Any, config: object) -> None:
    """Writes a page for each public class, before pages are listed, and removes those of former classes."""
    folder = ROOT / "docs" / "reference" / "api"
    folder.mkdir(exist_ok=True)
    pages = {folder / f"{name}.md": describe_class(name) for name in list_classes()}
    for path in set(folder.iterdir()) - set(pages):
        path.unlink()
    for path, text in pages.items():
        if (
            not path.is_file() or path.read_text(encoding="utf-8") != text
        ):  # else the page is read anew at every build
            path.write_text(text, encoding="utf-8")


def skip_field(app: Any, what: str, name: str, member: object, skip: bool, options: object) -> bool | None:
    """Skips fields of a NamedTuple, which its docstring describes and Python calls an alias for a number."""
    return True if str(member.__doc__).startswith("Alias for field number") else None


def drop_bounds(app: Any, obj: Any, bound_method: bool) -> None:
    """Leaves bounds and sources of arguments out of signatures: docstrings and other pages give them."""
    function = getattr(obj, "__func__", obj)
    if hints := getattr(function, "__annotations__", None):
        function.__annotations__ = {name: _strip(hint) for name, hint in hints.items()}


def _strip(hint: Any) -> Any:
    if get_origin(hint) is Annotated:
        return _strip(hint.__origin__)
    is_union = get_origin(hint) in (types.UnionType, Union)
    return functools.reduce(operator.or_, map(_strip, get_args(hint))) if is_union else hint


def shorten_defaults(
    app: Any, what: str, name: str, obj: object, options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Shortens defaults: paths of this machine, and what objects hold that have a page of their own."""
    if signature:
        signature = signature.replace(f"PosixPath('{MODELS}')", "MODELS")
        signature = re.sub(rf"PosixPath\('{MODELS}/(.*?)'\)", r"MODELS / '\1'", signature)
        signature = re.sub(r"PosixPath\(('.*?')\)", r"\1", signature)
        signature = re.sub(r"= (\w+)\((?:[^()]|\([^()]*\))*\)", r"= \1()", signature)
        signature = re.sub(r"<function (\w+)>", r"\1", signature.replace("<factory>", "..."))
    return signature, returned


def repair_docstring(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Drops Python's own docstring of named tuples; turns a colon that napoleon would end a type with into a dash."""
    lines[:] = [line for line in lines if not line.startswith("Create new instance of ")]
    if what == "property" and lines:
        lines[0] = lines[0].replace(": ", " \u2013 ", 1)


def setup(app: Any) -> None:
    """Adds what this file defines to Sphinx."""
    add_formulas(app)
    app.connect("builder-inited", write_entrance)
    app.connect("config-inited", write_classes)
    app.connect("source-read", fill_page)
    app.connect("autodoc-skip-member", skip_field)
    app.connect("autodoc-before-process-signature", drop_bounds)
    app.connect("autodoc-process-signature", shorten_defaults)
    app.connect("autodoc-process-docstring", repair_docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", lambda app, what, name, thing, options, lines: link_documents(lines))
