"""Repeats sent to a Dask cluster: the same numbers as here, whatever happens to a worker."""

import functools
import socket
import sys
import threading
import time
from pathlib import Path

import joblib
import numpy as np
import pytest
from helpers.dask_cluster import DaskCluster
from helpers.noted_repeats import note_and_draw
from helpers.refusals import refuse

from affordance.files.model_folder import MODELS
from affordance.runs.cluster import use_cluster
from affordance.runs.repeats import run_repeats

REPEATS = 12


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    cluster = DaskCluster(tmp_path_factory.mktemp("cluster"), imports=Path(__file__).parents[1])
    yield cluster
    cluster.stop()


def run(folder, notes):
    repeat = functools.partial(note_and_draw, notes)
    return run_repeats(folder, repeat, repeats=REPEATS, jobs=1, description="test")["drawn"]


def list_runs(notes):
    """Numbers of the repeats that each process ran."""
    runs = [path.name.split("_") for path in notes.iterdir()]
    return {pid: {int(repeat) for other, repeat in runs if other == pid} for pid, _ in runs}


def test_cluster_is_complete_and_gives_the_same_numbers_though_a_worker_is_killed(tmp_path, cluster):
    with cluster.connect() as client:
        assert len(client.nthreads()) == 2
    assert len({cluster.find_worker(worker) for worker in cluster.workers}) == 2
    notes = {name: tmp_path / "notes" / name for name in ("here", "there")}
    for folder in notes.values():
        folder.mkdir(parents=True)
    here = run(tmp_path / "here", notes["here"])
    victim = cluster.workers[0]

    def kill_in_mid_run():
        deadline = time.monotonic() + 60
        while len(list_runs(notes["there"]).get(str(victim.pid), ())) < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
        victim.kill()

    killer = threading.Thread(target=kill_in_mid_run)
    with use_cluster(cluster.address, MODELS):
        killer.start()
        there = run(tmp_path / "there", notes["there"])
    killer.join()
    victim.wait()
    np.testing.assert_array_equal(here, there)
    ran = list_runs(notes["there"])
    assert set(ran) == {str(worker.pid) for worker in cluster.workers}
    assert len(ran[str(victim.pid)]) >= 2
    # Repeats that the victim had begun were begun anew by the other.
    assert sum(map(len, ran.values())) > REPEATS
    assert len(list((tmp_path / "there").glob("repeat_*.npz"))) == REPEATS


def test_without_cluster_work_stays_in_local_processes():
    backend, _ = joblib.parallel.get_active_backend()
    assert type(backend).__name__ == "LokyBackend"


def use(address):
    with use_cluster(address, MODELS):
        pass


@pytest.mark.parametrize("address", ["", "somewhere", "http://host:1", "tcp://host", "tcp://a b:1", "tcp://:80"])
def test_what_is_no_address_is_refused(address):
    assert f"--cluster: is '{address}', must be an address such as tcp://host:8786" in refuse(use, address)


def test_address_where_nobody_answers_is_refused(monkeypatch):
    monkeypatch.setattr("affordance.runs.cluster._PATIENCE", 0.5)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    assert f"is '{address}', where no Dask scheduler answers" in refuse(use, address)


def test_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "--cluster: needs the extra [cluster]: pip install" in refuse(use, "tcp://host:1")


@pytest.mark.parametrize(
    ("workers", "said"),
    [
        ({"num_workers": 0}, "a scheduler without workers"),
        ({"num_workers": 1, "num_threads": 2}, "with 2 threads, must have one"),
    ],
)
def test_cluster_without_workers_of_one_thread_is_refused(tmp_path, monkeypatch, workers, said):
    if not workers["num_workers"]:
        monkeypatch.setattr("affordance.runs.cluster._PATIENCE", 1.0)
    cluster = DaskCluster(tmp_path, **workers)
    try:
        assert said in refuse(use, cluster.address)
    finally:
        cluster.stop()


def test_worker_with_other_libraries_is_refused(cluster, monkeypatch):
    monkeypatch.setattr("affordance.runs.repeats.list_versions", lambda: {"numpy": "0"})
    assert "whose program, models or libraries differ from those here" in refuse(use, cluster.address)
