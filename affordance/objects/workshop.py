"""Materials of the workshop: those that an observer who knows workshop tools recognises by sight."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from affordance.files.model_folder import MODELS
from affordance.objects.load import list_materials
from affordance.objects.material import Material
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool

# Files of tools and of held objects, in the folder workshop/ of the models.
_FILES = ("tools.yaml", "uncommon.yaml", "blanks.yaml", "hps.yaml")


def load_workshop_materials(models: Path = MODELS) -> dict[str, Material]:
    """Loads the materials that workshop tools are made of, by name, in the order of the materials file.

    Raises:
        BadValueError: A file is wrong; the message gives file and reason.
    """
    return select_known(load_materials(models / "materials.yaml"), (), models)


def select_known(
    materials: Mapping[str, Material], tools: Sequence[Tool], models: Path = MODELS
) -> dict[str, Material]:
    """Selects the materials of workshop tools and of some further tools, by name, in their order.

    Args:
        materials: Materials to select from.
        tools: Tools whose materials, and the materials that they look like, are known too.
        models: Folder of models that has the workshop.
    """
    names = {name for file in _FILES for name in list_materials(models / "workshop" / file)}
    names |= {each.name for tool in tools for part in tool.components for each in (part.material, part.looks_like)}
    return {name: material for name, material in materials.items() if name in names}
