"""Scripts by which shells complete commands and options."""

import shutil
import subprocess

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command

from affordance.commands.catalogue import COMMANDS

ASK = 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($#-1)); _affordance; echo "${COMPREPLY[*]}"'


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    path = tmp_path_factory.mktemp("completion") / "script.bash"
    path.write_text(answer("completion", "bash").out)
    return path


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["ra"], "rank"),
        (["com"], "compare-learners compare-robots completion com"),
        (["rank", "--se"], "--see --seed --set"),
        (["rank", "--see", ""], "drawing features pictures"),
        (["run", "two"], "two_families"),
        (["weight", "--learner", "no"], "nothing_remembered"),
        (["compare-learners", "--learner", "own"], "own_memory own_and_shared"),
        (["weight", "--rep"], "--repeats"),
        (["memory", "we"], "weigh"),
        (["run", "--observ"], ""),  # a former name, which is not shown
    ],
)
def test_bash_completes_words(script, words, completed):
    command = ["bash", "-c", ASK, str(script), "affordance", *words]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == completed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_script_is_of_the_shell_and_names_every_command(shell, tmp_path):
    text = answer("completion", shell).out
    assert all(name in text for name in COMMANDS)
    assert "--see" in text or "-l see" in text
    if shutil.which(shell):
        (tmp_path / "script").write_text(text)
        subprocess.run([shell, "-n", str(tmp_path / "script")], check=True)


def test_fish_completes_learners_and_files():
    (line,) = [each for each in answer("completion", "fish").out.splitlines() if "from fit' -l learner" in each]
    assert " -r -a 'density kinds_map kinds_drawn nothing_remembered own_memory own_and_shared' -d " in line


def test_another_shell_is_refused():
    assert (
        refuse_command("completion", "csh")
        == "affordance completion: shell: is 'csh', must be one of bash, zsh, fish; did you mean 'zsh'?"
    )
