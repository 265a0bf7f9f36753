"""Small runs of the shipped experiments, each made once for all processes of a run of the tests."""

import functools
from collections.abc import Callable

import pytest
from helpers.shared import compute_once, find_shared_folder
from helpers.shipped_runs import Run, run_shipped


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
