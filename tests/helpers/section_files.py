"""Section files of the program, by name."""

from pathlib import Path

from affordance.files.model_folder import MODELS

ROOT = MODELS.parent


def find_sections() -> dict[str, Path]:
    """Finds the section files."""
    return {path.stem: path for path in (ROOT / "affordance" / "experiments" / "sections").glob("*.yaml")}
