"""Lasting memory of the one observer of a run."""

import os
import signal
import sys
import time

import pytest
from helpers.children import PATIENCE, ROOT
from helpers.trials import WOOD, hold

from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.extensions.memory.lasting_memory import remember_in
from affordance.extensions.memory.ledger import open_memory
from affordance.simulation.trial import Observer

# Program that says, by a line, when it begins a trial, and then waits in the third for ever.
PROGRAM = """
import sys, time
from affordance.cli import main
from affordance.simulation import trial
hold, count = trial.Observer.hold, 0

def hold_noted(self, *arguments, **words):
    global count
    count += 1
    while count == 3:
        print("third", flush=True)
        time.sleep(1000.0)
    return hold(self, *arguments, **words)

trial.Observer.hold = hold_noted
sys.exit(main(sys.argv[1:]))
"""


def test_observer_begins_with_what_is_remembered_and_a_seed_of_its_own(tmp_path):
    place = tmp_path / "memory.sqlite"
    novice = remember_in(Setup(observers=1, seed=4), place)
    assert novice.seed == 4
    assert novice.start_memory(0).colours == ()
    with open_memory(place) as ledger:
        ledger.append([hold("bar", (WOOD,), (600.0,), second) for second in range(3)])
        known = ledger.recall()
    begun = remember_in(Setup(observers=1, seed=4), place)
    assert begun.seed == 7
    assert begun.start_memory(0).colours == known.colours
    assert begun.start_memory(0).belief.compute_mode() == pytest.approx(known.belief.compute_mode())
    assert remember_in(Setup(observers=1, seed=2**32 - 1), place).seed == 2


def test_each_trial_is_appended_when_it_is_over(tmp_path, monkeypatch):
    monkeypatch.setattr(weight, "DURATION", 0.1)
    place = tmp_path / "memory.sqlite"
    setup = remember_in(Setup(observers=1), place)
    tools = weight.read(setup)
    lengths, hold_one = [], Observer.hold

    def hold_noted(self, *arguments, **words):
        with open_memory(place) as ledger:
            lengths.append(len(ledger))
        return hold_one(self, *arguments, **words)

    monkeypatch.setattr(Observer, "hold", hold_noted)
    weight.hold(setup, tools, 0)
    assert lengths == [0, 1, 2, 3, 4]


def test_killed_run_loses_at_most_the_running_trial(children, tmp_path):
    """Two trials are over when the process is killed in its third, and both are in the memory, which is sound."""
    place = tmp_path / "memory.sqlite"
    words = ("run", "weight", "--memory", place, "--jobs", 1, "--out", tmp_path / "out")
    process = children([sys.executable, "-c", PROGRAM, *map(str, words)], cwd=ROOT)
    assert process.stdout is not None
    begin = time.monotonic()
    while process.stdout.readline().strip() != "third":
        assert time.monotonic() < begin + PATIENCE
        assert process.poll() is None, process.communicate()
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    with open_memory(place) as ledger:
        assert len(ledger) == 2
        assert ledger.verify() == []
