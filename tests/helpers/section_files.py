"""Section files of the program and of the studies, by name."""

from pathlib import Path

from affordance.files.model_folder import MODELS

ROOT = MODELS.parent


def find_sections() -> dict[str, Path]:
    """Finds the section files; that of a study has the name of its folder."""
    shipped = (ROOT / "affordance" / "experiments" / "sections").glob("*.yaml")
    studies = (ROOT / "studies").glob("*/section.yaml")
    several = (ROOT / "studies").glob("*/sections/*.yaml")
    return {path.stem: path for path in (*shipped, *several)} | {path.parent.name: path for path in studies}
