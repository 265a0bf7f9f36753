"""Demonstrations run on files of the package, and print their commands."""

from affordance.cli import main
from affordance.commands.demo import EMPTY, LOADED, MASS, TRIALS


def test_identify_says_its_command_and_finds_the_mass_of_the_simulation(capsys):
    assert main(["identify", "--demo", "--samples", "500"]) == 0
    said = capsys.readouterr().out
    first, second, *_ = said.splitlines()
    assert "simulated recordings" in first
    assert second.startswith("    affordance identify ")
    mass, sd = map(float, next(line for line in said.splitlines() if line.startswith("mass ")).split()[1:3])
    assert abs(mass - MASS) < 3.0 * sd < 0.02
    assert "\n  oak #b07a45: " in said
    assert f"weighs {MASS:.3f} kg" in said.splitlines()[-1]


def test_rank_says_its_commands_and_what_to_take(capsys):
    assert main(["rank", "--demo", "--samples", "200", "--only", "machinist hammer"]) == 0
    first, second, third, *_, last = capsys.readouterr().out.splitlines()
    assert "simulated recordings" in first
    assert second.startswith("    affordance memory import demo.sqlite ")
    assert third == "    affordance rank hammer --memory demo.sqlite"
    assert last.startswith("Take the ")


def test_trials_are_of_the_arm_that_simulations_have(tmp_path, capsys):
    place = str(tmp_path / "demo.sqlite")
    assert main(["memory", "import", place, str(TRIALS)]) == 0
    assert main(["memory", "show", place]) == 0
    assert capsys.readouterr().out.count("paper's arm") == 8


def test_recordings_are_small():
    assert sum(path.stat().st_size for path in (EMPTY, LOADED, TRIALS)) < 300_000
