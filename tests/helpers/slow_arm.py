"""Our arm with joints so slow that the tip's speed stays far below that of our arm's blow."""

import re
import shutil
from pathlib import Path

from affordance.files.model_folder import MODELS

# Part of our arm's joint velocity limits, and with them how deep it can drive the nail, [m], in which time, [s].
SLOWER, DEPTH, DURATION = 0.02, 0.0052, 1.6


def make_slow_models(folder: Path) -> Path:
    """Writes the models of such an arm, with a nail that it can drive, into a new folder."""
    models = folder / "slow_models"
    shutil.copytree(MODELS, models)
    arm, nail = models / "arm.sdf", models / "nail.yaml"
    text = arm.read_text(encoding="utf-8")
    slow = re.sub(r"<velocity>([\d.]+)<", lambda found: f"<velocity>{SLOWER * float(found[1]):g}<", text)
    assert slow != text
    arm.write_text(slow, encoding="utf-8")
    text = nail.read_text(encoding="utf-8")
    for old, new in (("depth_demanded: 0.01722", DEPTH), ("duration: 0.8", DURATION)):
        assert old in text
        text = text.replace(old, f"{old.split()[0]} {new:g}")
    nail.write_text(text, encoding="utf-8")
    return models
