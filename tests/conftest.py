"""Fixtures that several modules share. Plants and Diagrams take long to build, so one of each serves a process."""

import functools
import gc
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

# Before numpy is imported: matrices here are small, and threads of its libraries would wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from helpers.children import Start, keep_children
from helpers.kept_plans import keep_plans
from helpers.shared import compute_once, find_shared_folder
from helpers.shipped_runs import Run, run_shipped
from helpers.two_tools import HELD
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, load_hammer
from affordance.files.model_folder import MODELS
from affordance.objects.colour import Colour
from affordance.objects.load import load_tools
from affordance.objects.tool import Tool, list_colours
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import load_arm
from affordance.plant.serial_chain import SerialChain
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import TrialRunner

HERE = Path(__file__).parent
# Files of about eight seconds and more, about in order.
LONGEST = (
    "experiments/test_counter_examples.py",
    "extensions/pixels/test_seen_tool.py",
    "studies/calibration/test_calibration.py",
    "system/test_command_line.py",
    "commands/watch/test_watch.py",
    "extensions/payload/test_identify.py",
    "system/test_readme.py",
    "extensions/payload/test_doubts.py",
    "belief/test_truncated_normal.py",
    "extensions/robots/test_fitting.py",
    "commands/payload/test_identify.py",
)
# Tests of about two seconds or more, which take two thirds of the time of all; `make test-slow` runs them.
SLOW = frozenset((HERE / "slow_tests.txt").read_text(encoding="utf-8").splitlines())
DRAFT_DPI = 60
save_finely = Figure.savefig


class HeldObjects(NamedTuple):
    """Objects that are held, the colours that they show, and settings."""

    tools: tuple[Tool, ...]
    colours: tuple[Colour, ...]
    settings: Settings


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks slow tests, and puts files that take longest first, so that no process waits at the end."""
    for item in items:
        if item.nodeid.removeprefix("tests/") in SLOW:
            item.add_marker("slow")
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.relative_to(HERE).as_posix(), len(place)))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Freezes imported objects, so that each garbage collection saves the tens of milliseconds of looking at them."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261120)


@pytest.fixture(scope="session", autouse=True)
def _drafts() -> Iterator[None]:
    """Figures are drawn coarsely, and files of vectors stay empty; ``fine`` has them as users have them."""
    with pytest.MonkeyPatch.context() as patch:

        def save(figure: Figure, path: Path, **options: object) -> None:
            if "dpi" in options:
                save_finely(figure, path, **(options | {"dpi": DRAFT_DPI}))
            else:
                Path(path).touch()

        patch.setattr(Figure, "savefig", save)
        yield


@pytest.fixture(scope="session", autouse=True)
def _any_width() -> Iterator[None]:
    """Answers are as wide as they need to be, whatever the terminal of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("COLUMNS", raising=False)
        yield


@pytest.fixture(scope="session", autouse=True)
def _kept_plans(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Swings and motions are planned once, whichever test needs them first."""
    with keep_plans(find_shared_folder(tmp_path_factory) / "plans"):
        yield


@pytest.fixture
def fine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are written as users have them."""
    monkeypatch.setattr(Figure, "savefig", save_finely)


@pytest.fixture
def vectors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Writes figures as vector files, and leaves pictures empty."""

    def save(figure: Figure, path: Path, **options: object) -> None:
        Path(path).touch() if "dpi" in options else save_finely(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", save)


@pytest.fixture
def unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are drawn, but files of them stay empty: for tests that look at no picture, as rendering takes long."""
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **options: Path(path).touch())


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A copy of the models, whose files may be changed."""
    return shutil.copytree(MODELS, tmp_path / "models")


@pytest.fixture
def children() -> Iterator[Start]:
    """Starts processes, which end with the test."""
    with keep_children() as start:
        yield start


@pytest.fixture(scope="session")
def arm() -> Arm:
    return load_arm()


@pytest.fixture
def model(arm: Arm) -> ArmModel:
    return ArmModel(arm)


@pytest.fixture(scope="session")
def chain(arm: Arm) -> SerialChain:
    return build_chain(arm)


@pytest.fixture(scope="session")
def hold(arm: Arm) -> StaticHold:
    """The arm at rest in its home posture."""
    return StaticHold(arm)


@pytest.fixture
def at_home(arm: Arm) -> Array:
    """State of rest in the home posture."""
    return np.concatenate([arm.home, np.zeros(arm.num_joints)])


@pytest.fixture(scope="session")
def weight() -> HeldObjects:
    """The rods and the decoy of Simulation I."""
    tools = load_tools(MODELS / "tools" / "weight.yaml")
    return HeldObjects(tools, list_colours(tools), DEFAULT_SETTINGS)


@pytest.fixture(scope="session")
def runner() -> TrialRunner:
    return TrialRunner(DEFAULT_SETTINGS)


@pytest.fixture(scope="session")
def hammer() -> Hammer:
    return load_hammer(MODELS / "nail.yaml")


@pytest.fixture(scope="session")
def own_model(arm: Arm) -> ArmModel:
    """Model of our arm that all tests share, with the state and payload that the last of them set."""
    return ArmModel(arm)


@pytest.fixture(scope="session")
def planned(hammer: Hammer, own_model: ArmModel) -> dict[str, BlowCost]:
    """Blows with the stick, by its grips."""
    return {grip: hammer.build_cost(own_model, tool.components, DEFAULT_SETTINGS) for grip, tool in HELD.items()}


@pytest.fixture(scope="session")
def get_shipped(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Run]:
    """Function that returns the small run of a shipped experiment, by its name."""
    out = find_shared_folder(tmp_path_factory) / "shipped"

    @functools.cache
    def get(name: str) -> Run:
        return compute_once(tmp_path_factory, f"shipped_{name}", lambda: run_shipped(name, out))

    return get


@pytest.fixture(scope="module")
def shipped(request: pytest.FixtureRequest, get_shipped: Callable[[str], Run]) -> Run:
    """Small run of the experiment that the module of the test is about, ``test_NAME.py``."""
    return get_shipped(request.path.stem.removeprefix("test_"))
