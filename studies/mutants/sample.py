"""Sample of mutants, with the outcome of each: sample.json."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SAMPLE = Path(__file__).with_name("sample.json")
FOLDERS = (
    "belief",
    "proprioception",
    "plant",
    "control",
    "choice",
    "identification",
    "studies/robustness",
    "studies/recorded",
    "studies/hammering",
)
Mutant = dict[str, Any]


def get_folder(mutant: Mutant) -> str:
    """Names the folder of a mutant's module and of its tests, with the folders inside it."""
    module = mutant["module"].removeprefix("affordance/")
    return next(folder for folder in FOLDERS if module.startswith(f"{folder}/"))


def read_sample() -> tuple[int, list[Mutant]]:
    """Reads the seed of the sample, and its mutants."""
    content = json.loads(SAMPLE.read_text(encoding="utf-8"))
    return content["seed"], content["mutants"]


def write_sample(seed: int, mutants: Sequence[Mutant]) -> None:
    """Writes a sample and its outcomes, a mutant a line."""
    lines = ",\n".join(json.dumps(mutant) for mutant in mutants)
    SAMPLE.write_text(f'{{"seed": {seed}, "mutants": [\n{lines}\n]}}\n', encoding="utf-8")
