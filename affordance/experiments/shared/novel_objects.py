"""The objects that are chosen about and never held, in simulations III and IV."""

from dataclasses import dataclass
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.experiments.com import load_objects
from affordance.experiments.shared.checks import check_tools_are_honest, check_tools_can_be_held
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM
from affordance.settings import Settings
from affordance.vision.features import FeatureSource

# Lengths of an object in two grips that differ by less are equal, [m].
_SAME_LENGTH = 1e-9


@dataclass(frozen=True)
class NovelObjects:
    """The objects that are chosen about and never held.

    Attributes:
        plain: Its shape says nothing about which end to hold.
        headed: Its shape does; it is run beside the other.
    """

    plain: Tool
    headed: Tool


def load_novel_objects(models: Path, experience: ExperienceConfig) -> NovelObjects:
    """Reads the novel objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make these experiments.
    """
    path = models / "tools" / "novel.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) != 2:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 2: a plain object and a headed one")
    for tool in tools:
        if len(tool.grips) != 2:
            raise BadValueError(path, f"tools: {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2")
        unknown = {
            part.looks_like.name for part in tool.components if part.looks_like.colour not in experience.colours
        }
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what com.yaml is made of"
            raise BadValueError(path, f"tools: {tool.name}", problem)
        lengths = [float(tool.gripped_by(grip).p_TTfree[0]) for grip in tool.grips]
        if abs(lengths[0] - lengths[1]) > _SAME_LENGTH:
            problem = f"reach {lengths[0]:g} and {lengths[1]:g} m beyond the hand, must reach equally far"
            raise BadValueError(path, f"tools: {tool.name}.grips", problem)
    check_tools_are_honest(path, tools)
    plain, headed = tools
    if [grip.name for grip in plain.grips] != [grip.name for grip in headed.grips]:
        raise BadValueError(path, "tools", "have grips of different names, must have the same in the same order")
    return NovelObjects(plain, headed)


def load_subjects(models: Path, seed: int, feature_source: FeatureSource) -> tuple[ExperienceConfig, NovelObjects]:
    """Reads arm and objects from a folder of models: those that are held, and those that are chosen about.

    Raises:
        BadValueError: A file is wrong, or the objects do not make these experiments.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    *honest, _ = load_objects(models)
    settings = Settings(arm=models / ARM.name, feature_source=feature_source)
    experience = ExperienceConfig(tuple(honest), seed, settings)
    novel = load_novel_objects(models, experience)
    check_tools_can_be_held(models / "tools" / "com.yaml", honest, settings)
    held = [tool for each in (novel.plain, novel.headed) for tool in hold(each).values()]
    check_tools_can_be_held(models / "tools" / "novel.yaml", held, settings)
    return experience, novel


def hold(tool: Tool) -> dict[str, Tool]:
    """The tool in each of its grips, by their names."""
    return {grip.name: tool.gripped_by(grip) for grip in tool.grips}
