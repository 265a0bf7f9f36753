"""Studies as their users run them, in this process."""

import argparse

from studies.study import Study


def run_study(study: Study, *words: object) -> int:
    """Runs a study with options of its command line; returns the exit status."""
    parser = argparse.ArgumentParser()
    study.add_arguments(parser)
    return study.run(parser.parse_args([str(word) for word in words]))
