"""Studies as their users run them, in this process."""

import argparse
from collections.abc import Mapping
from typing import Any

from studies.study import Study

type Numbers = Mapping[str, Any]


def run_study(study: Study, *words: object) -> int:
    """Runs a study with options of its command line; returns the exit status."""
    parser = argparse.ArgumentParser()
    study.add_arguments(parser)
    return study.run(parser.parse_args([str(word) for word in words]))
