"""Several experiments into one folder, by made-up ones; then the catalogue of those that there are."""

import functools

import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.refusals import refuse
from helpers.results_files import read_numbers
from matplotlib.figure import Figure

from affordance.exceptions import BadValueError, InfeasibleError, StallError, UnavailableError
from affordance.experiments import com, weight
from affordance.experiments.shared import experience, suite
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.experiments.shared.suite import run_suite
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.simulated_trial import remember_in
from affordance.files.lacks import write_lacks
from affordance.proprioception.faults import Faults

DATA = xr.Dataset({"drawn": ("observer", [1.0], {"units": "1", "long_name": "what was drawn"})})


def list_files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


class MadeUp:
    """Experiments that note what is done, in order."""

    def __init__(self):
        self.done = []
        self.errors = {}  # by step and name

    def make(self, name, observers=200, needs=(), no_memory=""):
        def run(setup):
            self._do("run", name, setup)
            found = ", ".join(list_files(setup.out)) if setup.out.exists() else ""
            numbers = {"found": found, "models": setup.models.name}
            return Results(
                name, "A summary.", "A finding.", DATA, numbers, [], figures={"figure": ("A figure.", Figure)}
            )

        read = functools.partial(self._do, "read", name)
        return Experiment(run, read, None, observers, needs, no_memory, every_learner=False)

    def _do(self, step, name, setup):
        self.done.append(f"{step} {name}")
        if (step, name) in self.errors:
            raise self.errors[step, name]


@pytest.fixture
def made_up(monkeypatch):
    """Two made-up experiments, "one" and "other"; the latter needs a path."""
    made = MadeUp()
    experiments = {
        "one": made.make("one", needs=("objects",)),
        "other": made.make("other", needs=("objects", "path")),
        "third": made.make("third", no_memory="in which nothing is felt"),
    }
    monkeypatch.setattr(suite, "find_experiment", experiments.__getitem__)
    return made


def test_experiments_are_read_first_and_run_in_turn_each_in_a_folder_of_its_name(made_up, tmp_path):
    out = tmp_path / "deep" / "out"
    announced = []
    found = run_suite(
        ["other", "one"], Setup(out=out), announce=lambda report: announced.append((report, list_files(out)))
    )
    assert made_up.done == ["read other", "read one", "run other", "run one"]
    assert found == (out / "report.html", {}, {"other": "A finding.", "one": "A finding."})
    files = [f"other/{name}" for name in ("data.nc", "figure.png", "figure.svg", "metrics.json", "section.json")]
    # There is a report after the first of them.
    assert announced == [(out / "report.html", [*files, "report.html"])]
    assert list_files(out) == [*(name.replace("other", "one") for name in files), *files, "report.html"]
    assert read_numbers(out / "one")["found"] == ", ".join([*files, "report.html"])


def test_one_experiment_is_not_announced(made_up, tmp_path):
    announced = []
    run_suite(["one"], Setup(out=tmp_path), announce=announced.append)
    assert announced == []


def test_experiment_that_cannot_be_run_is_left_out_and_named(made_up, tmp_path, caplog):
    made_up.errors["run", "other"] = BadValueError("nail.yaml", "blow", "cannot be carried out")
    found = run_suite(["other", "one"], Setup(out=tmp_path))
    assert found.left_out == {"other": "nail.yaml: blow: cannot be carried out"}
    assert "other is left out: nail.yaml: blow: cannot be carried out" in caplog.text
    assert "left_out.json" in list_files(tmp_path)
    assert not (tmp_path / "other").exists()
    assert "nail.yaml: blow: cannot be carried out" in found.report.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "error", [StallError("stick", 0.8, 5, ()), UnavailableError("rendered pictures are", "libEGL.so.1 is missing")]
)
def test_experiment_that_ends_while_it_is_run_is_left_out_and_the_next_is_run(made_up, tmp_path, error):
    made_up.errors["run", "one"] = error
    assert run_suite(["one", "other"], Setup(out=tmp_path)).left_out == {"one": str(error)}
    assert (tmp_path / "other" / "metrics.json").exists()
    assert str(error) in refuse(run_suite, ["one"], Setup(out=tmp_path), error=type(error))


def test_files_of_which_one_is_wrong_start_no_experiment(made_up, tmp_path):
    made_up.errors["read", "other"] = BadValueError("novel.yaml", "tools", "is empty")
    assert refuse(run_suite, ["one", "other"], Setup(out=tmp_path / "out")) == "novel.yaml: tools: is empty"
    assert made_up.done == ["read one", "read other"]
    assert not (tmp_path / "out").exists()


def test_arm_that_is_too_weak_for_one_experiment_does_the_others(made_up, tmp_path):
    made_up.errors["read", "other"] = InfeasibleError("novel.yaml", "tools", "is too heavy")
    assert run_suite(["other", "one"], Setup(out=tmp_path)).left_out == {"other": "novel.yaml: tools: is too heavy"}
    assert made_up.done == ["read other", "read one", "run one"]


def test_report_forgets_what_was_left_out_once_it_is_done(made_up, tmp_path):
    """A later run that succeeds names nothing as left out; the section of an infeasible experiment is removed."""
    section = tmp_path / "other" / "section.json"
    section.parent.mkdir()
    section.write_text("{}", encoding="utf-8")
    made_up.errors["run", "other"] = BadValueError("nail.yaml", "blow", "cannot be carried out")
    run_suite(["other", "one"], Setup(out=tmp_path))
    assert not section.exists()
    made_up.errors.clear()
    report, left_out, _ = run_suite(["other"], Setup(out=tmp_path))
    assert not left_out
    assert "cannot be carried out" not in report.read_text(encoding="utf-8")
    assert not (tmp_path / "left_out.json").exists()


def test_nothing_is_written_where_none_of_them_can_be_done(made_up, tmp_path):
    made_up.errors["run", "other"] = BadValueError("nail.yaml", "blow", "cannot be carried out")
    assert "cannot be carried out" in refuse(run_suite, ["other"], Setup(out=tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_what_the_import_of_the_arm_could_not_fit_is_not_read_again(made_up, tmp_path, models):
    """Experiments that the import found infeasible are left out unless a file was changed."""
    write_lacks(models, {"path": "stick by wood leaves the path by 0.05 m"})
    setup = Setup(out=tmp_path / "out", models=models)
    found = run_suite(["one", "other"], setup)
    assert made_up.done == ["read one", "run one"]
    assert found.left_out["other"].endswith("its import reported: stick by wood leaves the path by 0.05 m")
    assert "leaves the path" in refuse(run_suite, ["other"], setup, error=InfeasibleError)
    change_file(models / "paths" / "reach.yaml", "duration: 2.0", "duration: 4.0")
    assert not run_suite(["other"], setup).left_out


def test_leftovers_of_a_killed_run_are_removed_wherever_they_lie(made_up, tmp_path):
    kept = tmp_path / "experience" / "0123" / "repeat_00000.npz"
    kept.parent.mkdir(parents=True)
    kept.write_text("kept", encoding="utf-8")
    for folder in (tmp_path, kept.parent, tmp_path / "one"):
        folder.mkdir(exist_ok=True)
        (folder / ".writing.123.repeat_00001.npz").write_text("half", encoding="utf-8")
    run_suite(["one"], Setup(out=tmp_path))
    assert not [*tmp_path.rglob(".writing.*")]
    assert kept.read_text(encoding="utf-8") == "kept"


def test_memory_is_refused_where_nothing_is_felt(made_up, tmp_path):
    setup = remember_in(Setup(observers=1, out=tmp_path / "out"), tmp_path / "memory.sqlite")
    said = refuse(run_suite, ["third"], setup)
    assert said == "--memory: has no effect on third, in which nothing is felt"
    run_suite(["one"], setup)


def test_folder_that_lies_below_a_file_and_a_joint_that_there_is_not_are_refused_first(made_up, tmp_path):
    (tmp_path / "file").touch()
    assert "is a file or is inside one" in refuse(run_suite, ["one"], Setup(out=tmp_path / "file"))
    setup = Setup(out=tmp_path / "out").change(faults=Faults(stuck_joint="knee"))
    assert "knee" in refuse(run_suite, ["one"], setup)
    assert made_up.done == []


def test_arm_that_cannot_hold_the_objects_of_one_experiment_does_the_others(tmp_path, models, monkeypatch):
    """Rods too heavy for the arm leave out Simulation I, and no more."""
    change_file(models / "tools" / "weight.yaml", *("[0.125, 0.015, 0.015]", "[0.125, 0.06, 0.06]"))
    made = MadeUp()
    for name, module in (("weight", weight), ("com", com)):
        monkeypatch.setattr(module, "EXPERIMENT", module.EXPERIMENT._replace(run=made.make(name).run))
    found = run_suite(["weight", "com"], Setup(out=tmp_path / "out", models=models))
    assert made.done == ["run com"]
    assert "loads" in found.left_out["weight"]


@pytest.mark.usefixtures("unrendered")
def test_memory_of_one_observer_is_filled_by_what_it_felt(tmp_path, monkeypatch):
    """The four simulations of the paper fill one memory, and the trials of the second begin where the first ended."""
    for module in (weight, com, experience):
        monkeypatch.setattr(module, "DURATION", 0.2)
    place = tmp_path / "memory.sqlite"
    for name, count in (("weight", 5), ("com", 14)):
        run_suite([name], remember_in(Setup(observers=1, out=tmp_path / "out"), place))
        with open_memory(place) as ledger:
            assert len(ledger) == count
            assert ledger.verify() == []
