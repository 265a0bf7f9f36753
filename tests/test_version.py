"""The commit of a program, where it is one of a repository's."""

import subprocess

import pytest

from affordance.version import find_commit


def run_git(folder, *arguments):
    names = ["-c", "user.name=A", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", *names, *arguments], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path):
    program = tmp_path / "program"
    program.mkdir()
    (program / "it.py").write_text("x = 1\n", encoding="utf-8")
    run_git(tmp_path, "init", "--quiet")
    run_git(tmp_path, "add", "program")
    run_git(tmp_path, "commit", "--quiet", "--message=first")
    run_git(tmp_path, "tag", "v1")
    return tmp_path


@pytest.fixture(autouse=True)
def forget():
    find_commit.cache_clear()


def test_commit_is_that_of_the_repository(repository):
    assert find_commit(repository / "program") == run_git(repository, "rev-parse", "HEAD")


def test_changes_since_are_told(repository):
    (repository / "program" / "it.py").write_text("x = 2\n", encoding="utf-8")
    assert find_commit(repository / "program") == run_git(repository, "rev-parse", "HEAD") + "-dirty"


def test_program_that_no_repository_keeps_has_none(repository, tmp_path_factory, monkeypatch):
    """A program installed into an environment within somebody's repository has no commit."""
    installed = repository / ".venv" / "program"
    installed.mkdir(parents=True)
    (installed / "it.py").write_text("x = 1\n", encoding="utf-8")
    assert find_commit(installed) is None
    assert find_commit(tmp_path_factory.mktemp("elsewhere")) is None
    assert find_commit(repository / "nowhere") is None
    monkeypatch.setenv("PATH", "")
    assert find_commit(repository / "program") is None
