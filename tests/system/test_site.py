"""Documentation site: every page is a chapter, generated parts name all there is, and links lead somewhere."""

import doctest
import importlib.util
import inspect
import io
import itertools
import re
import shutil
import sys
import types
import typing

import pytest
import yaml

import affordance
from affordance.commands.catalogue import COMMANDS
from affordance.experiments import weight
from affordance.extensions.payload.live import ros2
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind, SignalPrior
from affordance.files.model_folder import MODELS
from affordance.named_settings import describe_changes, list_settings
from affordance.settings import DEFAULT_SETTINGS
from studies.robustness.assumptions import sample_settings
from studies.robustness.build import build_world
from studies.robustness.study import load

ROOT = MODELS.parent
_SPEC = importlib.util.spec_from_file_location("generated", ROOT / "docs" / "generated.py")
generated = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(generated)
# Part of a page of the same name.
_PARTS = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)


def list_pages():
    found = [path for way in ("*.md", "docs/**/*.md", "affordance/tutorials/*.ipynb") for path in ROOT.glob(way)]
    return [ROOT / "models" / "README.md", *(path for path in found if path.parent.name != "api")]  # generated


def find_page(path):
    return next(page for suffix in (".md", ".ipynb") if (page := path.with_name(f"{path.name}{suffix}")).exists())


def list_chapters(page):
    """Pages below a page in the site, and below those."""
    found = {page}
    for block in re.findall(r"```\{toctree\}\n(.*?)```", generated.fill_marks(page.read_text()), re.DOTALL):
        for name in re.findall(r"^(?:.* <)?([^:\s*<>][^\s*<>]*)>?$", block, re.MULTILINE):
            found |= list_chapters(find_page((page.parent / name).resolve()))
    return found


def test_every_page_is_a_chapter():
    assert list_chapters(ROOT / "docs" / "index.md") == {page.resolve() for page in list_pages()}


def test_every_decision_stands_in_their_index_with_its_title():
    index = (ROOT / "docs" / "decisions" / "index.md").read_text()
    for page in ROOT.glob("docs/decisions/0*.md"):
        title = re.match(r"# \d+\. (.*)\n", page.read_text())[1]
        assert f"- [{page.name[:4]}]({page.name}): {title}\n" in index


def test_every_picture_has_an_alternative_text_and_a_caption():
    for page in ROOT.glob("docs/**/*.md"):
        for picture in re.finditer(r"!\[(?P<alt>[^\]]*)\]\([^)]*\)(?P<after>\n\n.)?", page.read_text()):
            assert picture["alt"], f"{page}: {picture[0]}"
            assert picture["after"] == "\n\n*", f"{page}: {picture[0]}"


def test_page_that_a_search_finds_first_has_main_entries_of_the_index():
    page = "# What\n\n<!-- search: wrong payload, payload -->\n"
    assert generated.fill_marks(page) == "# What\n\n```{index} ! wrong payload, ! payload\n```\n"


def test_pages_of_your_own_lead_to_each_other():
    own = {ROOT / "docs" / name for name in ("howto/own_learner.md", "experiments.md", "arms.md")}
    for page in own:
        links = {(page.parent / link).resolve() for link in re.findall(r"\]\(([^)#:]+\.md)", page.read_text())}
        assert own - {page} <= links, page


def test_every_generated_part_stands_in_one_page():
    marks = [name for page in list_pages() for name in _PARTS.findall(page.read_text())]
    assert sorted(marks) == sorted(generated.PARTS)


def test_errors_are_listed_without_the_libraries_of_extras(monkeypatch):
    listed = generated.PARTS["errors"]()
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    for name in [name for name in sys.modules if name.startswith(("cyclonedds.", f"{ros2.__name__}"))]:
        monkeypatch.delitem(sys.modules, name)
    assert generated.PARTS["errors"]() == listed


def test_generated_parts_name_all_there_is():
    names, commands, settings, errors = (
        generated.PARTS[name]() for name in ("names", "commands", "settings", "errors")
    )
    for name in affordance.__all__:
        shown = generated.describe_class(name) if name in generated.list_classes() else names
        assert f":: affordance.{name}\n" in shown
    for name in generated.list_classes():
        assert f"| [{name}](api/{name}.md) | " in names
    for name in COMMANDS:
        assert f"## {name}\n" in commands
    assert "`--reference-mass KG`" in commands
    for each in list_settings():
        assert f"| `{each.name}` |" in settings
    for error in ("AffordanceError", "BadArgumentError", "NoFitError"):
        assert f"| `{error}` |" in errors


@pytest.mark.parametrize("name", generated.list_classes())
def test_example_of_a_class_prints_what_its_page_shows(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = inspect.getdoc(getattr(affordance, name))
    assert "\nExample:\n" in text
    assert describe_failures(doctest.DocTestParser().get_doctest(text, {}, name, None, None)) == ""


def describe_failures(example):
    said = io.StringIO()
    doctest.DocTestRunner(verbose=False).run(example, out=said.write)
    return said.getvalue()


def test_cells_of_a_table_hold_bars_and_line_breaks():
    assert generated.format_rows(["a"], [["x|y\nz"]]) == "| a |\n| --- |\n| x\\|y z |"


def test_claims_stand_with_the_assumption_that_moves_them_most():
    (row,) = (line for line in generated.list_assumptions().splitlines() if line.startswith("| density of the rods"))
    moved = [
        "`weight.density_estimate` 0 to 100 %",
        "`weight.drop_reduced` 0 to 100 %",
        "`weight.first_object` 0 to 100 %",
    ]
    assert f"| {', '.join(moved)} |" in row
    (row,) = (line for line in generated.list_all_settings().splitlines() if line.startswith("| `cost_measure`"))
    assert "`hammer.light_taps` 8 to 71 %" in row


def test_values_are_shown_without_noise_of_rounding():
    parts = (generated.list_assumptions(), generated.list_all_settings(), generated.list_identification())
    values = [line.split(" | ")[1] for part in parts for line in part.splitlines()[2:]]
    assert {"0.08471", "0.004363", "1000000", "32000"} <= set(values)
    assert not [value for value in values if re.search(r"\d\.\d{7}", value)]


def test_settings_of_the_noise_stand_with_the_structure_that_varies_them():
    settings = {line.split("`")[1]: line for line in generated.list_all_settings().splitlines()[2:]}
    for name in ("noise.model", "noise.independent_samples", "sample_period"):
        assert "com.mass_and_com" in settings[name]
        assert "not varied" not in settings[name]
    assert "weight.density_estimate" not in settings["prior.mode"]
    assert "not varied" in settings["mpc.num_steps"]


def test_every_setting_that_the_study_varies_is_found_by_name():
    """Settings that a drawn setting of the study changes are exactly those that are not called "not varied"."""
    study = load()
    sample = sample_settings(study.assumptions, 8, 0)
    changed = set()
    for setting in sample:
        changed |= set(describe_changes(build_world(setting, MODELS, DEFAULT_SETTINGS).settings))
    rows = [line for line in generated.list_all_settings().splitlines()[2:] if "not varied" not in line]
    named = {row.split("`")[1] for row in rows}
    assert named == changed - {"noise.sd"}  # of the other model


def test_assumptions_of_identification_and_kinds_come_with_value_and_source():
    identification, learners = generated.list_identification(), generated.list_learners()
    settings = IdentificationSettings()
    for name in typing.get_type_hints(IdentificationSettings):
        assert f"| `{name}` | " in identification or name in ("signal_prior", "seed", "cutoff")
    for kind, name in itertools.product(SignalKind, typing.get_type_hints(SignalPrior)):
        assert f"| {kind.value}: `{name}` | " in identification
    assert f"| `block` | {settings.block:g} | s |" in identification
    assert "| current: `friction_sd` | 0.3 | unit of the signal |" in identification
    assert "| kinds, most probable: `kappa` | 0.2 |" in learners
    assert "| kinds, drawn: `kappa` | 0.22 |" in learners
    assert "`log_volume_sd` | 0.15 |" in learners
    for row in [*identification.splitlines()[2:], *learners.splitlines()[2:]]:
        assert all(cell.strip() for cell in row.strip("|").split("|")[3:])


def test_every_key_of_a_file_has_a_meaning():
    rows = [line for line in generated.list_formats().splitlines() if line.startswith("| `")]
    assert len(rows) > 80
    assert [line for line in rows if line.endswith("|  |")] == []


def test_every_key_of_a_shipped_file_stands_in_the_page_of_formats():
    """Keys that are names of the user's own, as of materials and faults, are left out; those below them are not."""
    page = (ROOT / "docs" / "reference" / "formats.md").read_text() + generated.list_formats()
    keys = set()
    for path in MODELS.rglob("*.yaml"):
        content = yaml.safe_load(path.read_text())
        if path.name in ("materials.yaml", "faults.yaml"):
            keys |= set().union(*content.values())
        elif not path.name.endswith(".dmd.yaml"):  # of Drake's own format
            keys |= set(content) | set(content.get("blow", {}))
    assert {"blow", "direction", "tilt", "kind", "bias_sd"} < keys
    assert {key for key in keys if f"`{key}`" not in page} == set()


def test_keys_of_files_come_with_units():
    formats = generated.list_formats()
    for row in (
        "| `semi_axes` | list of 3, each a number from 0.0001 to 1 |  | Semi-axes of an ellipsoid, [m]. |",
        "| `density` | number from 12 to 25000 | must be given | Density of the material, [kg/m^3]. |",
    ):
        assert row in formats


def test_how_tos_show_code_that_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("add_material", "own_prior"):
        page = (ROOT / "docs" / "howto" / f"{name}.md").read_text()
        for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
            exec(block, {})
    page = (ROOT / "docs" / "howto" / "add_material.md").read_text()
    (balsa,) = re.findall(r"```yaml\n(balsa:.*?)```", page, re.DOTALL)
    ((old, new),) = re.findall(r'sed -i "s/(.*?)/(.*?)/"', page)
    shutil.copytree(affordance.MODELS, tmp_path / "my_models")
    path, tools = tmp_path / "my_models" / "materials.yaml", tmp_path / "my_models" / "tools" / "weight.yaml"
    path.write_text(path.read_text() + balsa)
    tools.write_text(tools.read_text().replace(old, new))
    assert affordance.load_materials(path)["balsa"].density == 125.0
    *_, decoy = weight.read(affordance.Setup(models=path.parent))
    assert [part.material.name for part in decoy.components] == ["balsa"]


def test_questions_are_the_titles_of_how_tos():
    titles = [path.read_text().partition("\n")[0] for path in (ROOT / "docs" / "howto").glob("*.md")]
    assert len(titles) == 14
    assert all(re.fullmatch(r"# .*\?", title) for title in titles)


@pytest.fixture
def conf(monkeypatch):
    """Sphinx's configuration without the libraries of the extra ``docs``."""
    client = types.ModuleType("nbclient")
    client.NotebookClient = type("NotebookClient", (), {})
    formulas = types.ModuleType("docs.formulas")
    formulas.add_formulas = lambda app: None
    for name, stub in {"nbclient": client, "docs.formulas": formulas}.items():
        monkeypatch.setitem(sys.modules, name, stub)
    for name in ("PATH", "PYTHONPATH"):
        monkeypatch.setenv(name, "")  # which the configuration changes
    monkeypatch.setattr(sys, "path", list(sys.path))
    spec = importlib.util.spec_from_file_location("conf", ROOT / "docs" / "conf.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Builder:
    """Sphinx as far as the configuration uses it: events, and the page that is read."""

    def __init__(self, conf, out):
        self.outdir, self.handlers, self.env = str(out), [], self
        conf.setup(self)

    def connect(self, event, handler, priority=500):
        self.handlers.append((event, handler))

    def doc2path(self, name):
        return str(ROOT / "README.md")

    def emit(self, event, *arguments):
        for each, handler in self.handlers:
            if each == event:
                handler(self, *arguments)


def test_signatures_leave_out_bounds_and_paths_of_the_machine(conf):
    def take(x: typing.Annotated[typing.Annotated[float, "bound"] | None, "source"]): ...

    conf.drop_bounds(None, take, False)
    assert take.__annotations__ == {"x": float | None}
    given = (
        f"(a = PosixPath('{MODELS}'), b = PosixPath('{MODELS}/arm.sdf'), c = PosixPath('results'), d = Prior(sd=1.0))"
    )
    wanted = "(a = MODELS, b = MODELS / 'arm.sdf', c = 'results', d = Prior())"
    assert conf.shorten_defaults(None, "class", "", None, None, given, "Path") == (wanted, "Path")


@pytest.mark.parametrize(
    ("what", "given", "wanted"),
    [
        ("class", ["Create new instance of Run(q)"], []),
        ("property", ["Text of a run: its hash."], ["Text of a run \u2013 its hash."]),
        ("method", ["Reads it: all."], ["Reads it: all."]),
    ],
)
def test_docstrings_are_shown_as_written(conf, what, given, wanted):
    conf.repair_docstring(None, what, "", None, None, given)
    assert given == wanted


def test_front_page_is_written_before_anything_can_fail(conf, tmp_path):
    Builder(conf, tmp_path).emit("builder-inited")
    assert "url=docs/index.html" in (tmp_path / "index.html").read_text()


def test_no_page_is_limited_by_the_clock(conf):
    assert conf.nb_execution_timeout == -1
