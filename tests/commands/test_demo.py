"""Demonstrations run on files of the package, and print their commands."""

from helpers.answers import answer

from affordance import MODELS, TrialRunner, load_tools
from affordance.commands.demo import ARM_FILE, EMPTY, LOADED, MASS, PIECE, STOCK, TRIALS
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.simulated_trial import describe_trial


def test_identify_says_its_command_and_finds_the_mass_of_the_simulation():
    said = answer("identify", "--demo", "--samples", 500).out
    first, second, *_ = said.splitlines()
    assert "simulated recordings" in first
    assert second.startswith("    affordance identify ")
    mass, sd = map(float, next(line for line in said.splitlines() if line.startswith("mass ")).split()[1:3])
    assert abs(mass - MASS) < 3.0 * sd < 0.03
    assert "\n  oak #b07a45: " in said
    assert " SD of the mass " not in said  # the drawing told more than four more seconds of motion would
    assert "\n    set_target_payload(0.55" in said
    assert "; paired with empty.csv, lag" in said
    assert f"is {MASS:.3f} kg" in said.splitlines()[-1]


def test_rank_says_its_commands_and_what_to_take():
    first, second, third, _, sentence, *_ = answer(
        "rank", "--demo", "--samples", 200, "--only", "machinist hammer"
    ).lines
    assert "simulated recordings" in first
    assert second.startswith("    affordance memory import demo.sqlite ")
    assert third == "    affordance rank hammer --memory demo.sqlite"
    assert sentence.startswith("Take the ")


def test_trials_are_of_the_arm_that_simulations_have(tmp_path):
    place = tmp_path / "demo.sqlite"
    answer("memory", "import", place, TRIALS)
    assert answer("memory", "show", place).out.count("paper's arm") == 8


def test_arm_of_a_recording_is_that_of_a_simulated_trial(tmp_path):
    """A run identified by the paper's arm is of the robot that simulated holds are of, whose arm was no other."""
    place = tmp_path / "memory.sqlite"
    runner, tool = TrialRunner(), load_tools(MODELS / "tools" / "weight.yaml")[0]
    with open_memory(place) as ledger:
        record = runner.run_hold(tool, runner.start_memory(), duration=0.5, seed=(0, 0))
        ledger.append([describe_trial(record)])
    words = [ARM_FILE, "--empty", EMPTY, "--loaded", LOADED, "--object", STOCK, "--object-name", PIECE]
    words += ["--size-error", 0.02, "--unseen", 0.02, "--samples", 500, "--memory", place]
    said = answer("identify", *words).out
    assert "has learned them" in said
    assert "was another" not in said
    assert "models" not in answer("memory", "show", place).out


def test_recordings_are_small():
    assert sum(path.stat().st_size for path in (EMPTY, LOADED, TRIALS)) < 300_000
