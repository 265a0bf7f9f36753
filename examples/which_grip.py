"""Best grips of one stick: by one end for reaching, by the other end for driving a nail.

Prints:

    to reach along a path, take it by steel: 6.9 J; by wood 7.8 J
    to drive a nail, take it by wood: 8.0 J; by steel 9.3 J
"""

from affordance import MODELS, Hammer, MaterialMemory, Reach, list_options, load_hammer, load_path, load_tools, rank

stick, *_ = load_tools(MODELS / "tools" / "novel.yaml")
path, nail = load_path(MODELS / "paths" / "reach.yaml"), load_hammer(MODELS / "nail.yaml")
tasks: dict[str, Reach | Hammer] = {"reach along a path": Reach(path), "drive a nail": nail}
memory = MaterialMemory.from_densities({"steel": 7850, "beech": 720})
for name, task in tasks.items():
    first, second = rank(list_options(stick), task, memory).ranked
    print(
        f"to {name}, take it by {first.option.grip}: {first.work:.1f} J; by {second.option.grip} {second.work:.1f} J"
    )
