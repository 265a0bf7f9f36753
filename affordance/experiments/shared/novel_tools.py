"""The tools that are chosen about and never held, in Simulations III and IV."""

from pathlib import Path

from affordance.control.start_posture import Start
from affordance.exceptions import BadValueError
from affordance.experiments.shared.checks import check_tools_are_honest, check_tools_can_be_held
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.learning_objects import load_learning_objects
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Tool
from affordance.settings import Settings


def load_novel_tools(models: Path, experience: ExperienceConfig) -> tuple[Tool, ...]:
    """Reads the novel tools from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the tools do not make these experiments.
    """
    path = models / "tools" / "novel.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    for tool in tools:
        if len(tool.grips) != 2:
            raise BadValueError(path, f"tools: {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2")
        unknown = {
            part.looks_like.name for part in tool.components if part.looks_like.colour not in experience.colours
        }
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what com.yaml is made of"
            raise BadValueError(path, f"tools: {tool.name}", problem)
    check_tools_are_honest(path, tools)
    return tools


def load_subjects(
    models: Path, seed: int, settings: Settings, start: Start
) -> tuple[ExperienceConfig, tuple[Tool, ...]]:
    """Reads the objects that are held and the tools that are chosen about from a folder of models.

    Args:
        models: The folder.
        seed: Root of every random draw.
        settings: What all simulations share.
        start: Where the task starts, which the arm can take.

    Raises:
        BadValueError: A file is wrong, or the objects do not make these experiments.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    *honest, _ = load_learning_objects(models)
    experience = ExperienceConfig(tuple(honest), seed, settings)
    novel = load_novel_tools(models, experience)
    check_tools_can_be_held(models / "tools" / "com.yaml", honest, settings)
    held = [gripped for tool in novel for gripped in tool.list_gripped().values()]
    check_tools_can_be_held(models / "tools" / "novel.yaml", held, settings, start)
    return experience, novel
