"""Settings, objects and tasks of the experiments for a sampled setting."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.reach import Reach
from affordance.control.cost_measure import CostMeasure
from affordance.control.task import Start
from affordance.control.timed_path import TimedPath, load_path
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material, load_materials
from affordance.objects.tool import Component, Grip, Tool
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise, WhiteNoise
from affordance.settings import Settings
from studies.robustness.assumptions import Setting

# Number of independent samples per trial, by noise structure.
_NUM_SAMPLES = {"one percept": 30, "5 independent samples": 5, "30 independent samples": 30, "white": 30}
HOLD_DURATION = 3.0  # duration of a trial, as in the paper's figure 4, [s]
_NUM_RODS = 4


@dataclass(frozen=True)
class World:
    """Objects, tasks and choice rule for a setting."""

    settings: Settings  # settings of all simulations
    rods: tuple[Tool, ...]  # objects of Simulation I; the decoy is last
    learning: tuple[Tool, Tool, Tool]  # objects of Simulation II; the decoy is last
    novel: Tool  # tool of Simulations III and IV
    reach: Reach  # path of Simulation III
    hammer: Hammer  # blow of Simulation IV
    plans_least_work: bool  # True if blows minimise work
    rule: str  # choice rule, "one sample" or "expectation"

    @property
    def num_samples(self) -> int:
        """Number of samples per trial."""
        return round(HOLD_DURATION / self.settings.sample_period)


def build_world(setting: Setting, models: Path, settings: Settings) -> World:
    """Builds objects, tasks and simulation settings from the values of all assumptions.

    Args:
        setting: Values of all assumptions, by name.
        models: Folder with materials, path, nail and working posture.
        settings: Default settings of the simulations.
    """
    materials = load_materials(models / "materials.yaml")
    wood = replace(materials["beech"], density=float(setting["wood_density"]))
    steel = replace(materials["steel"], density=float(setting["dense_density"]))
    brass = replace(materials["brass"], density=float(setting["rod_density"]))
    hollow = replace(materials["beech"], density=float(setting["decoy_share"]) * brass.density)
    path = load_path(models / "paths" / "reach.yaml")
    hammer = load_hammer(models / "nail.yaml")
    return World(
        settings=_build_settings(setting, settings),
        rods=_build_rods(setting, brass, hollow),
        learning=_build_learning(setting, wood, steel),
        novel=build_novel(setting, wood, steel),
        reach=Reach(_build_path(setting, path)),
        hammer=_build_hammer(setting, hammer),
        plans_least_work=setting["planner"] == "least work",
        rule=str(setting["rule"]),
    )


def _build_settings(setting: Setting, settings: Settings) -> Settings:
    structure = str(setting["noise_structure"])
    noise: NoiseModel = WeberNoise(
        float(setting["weber_fraction"]), float(setting["threshold"]), independent_samples=structure != "one percept"
    )
    if structure == "white":
        noise = WhiteNoise(float(setting["white_sd"]))
    ticks = round(float(setting["horizon"]) / settings.control_period)
    return replace(
        settings,
        noise=noise,
        sample_period=HOLD_DURATION / _NUM_SAMPLES[structure],
        acceleration_sd=float(setting["acceleration_sd"]),
        prior=Prior(float(setting["prior_mode"]), float(setting["prior_sd"]), float(setting["deviation"])),
        mpc=replace(settings.mpc, horizon=ticks * settings.control_period),
        cost_measure=CostMeasure(str(setting["cost_measure"])),
    )


def _build_rods(setting: Setting, brass: Material, hollow: Material) -> tuple[Tool, ...]:
    lengths = np.linspace(float(setting["rod_shortest"]), float(setting["rod_longest"]), _NUM_RODS)
    radius = 0.5 * float(setting["rod_thickness"])

    def build(name: str, length: float, material: Material) -> Tool:
        shape = Ellipsoid((0.5 * length, radius, radius))
        return Tool(name, (Component(shape, _translate(0.5 * length), material, brass),))

    rods = [build(f"rod of {100.0 * length:.0f} cm", float(length), brass) for length in lengths]
    return (*rods, build("decoy", float(lengths[-1]), hollow))


def _build_learning(setting: Setting, wood: Material, steel: Material) -> tuple[Tool, Tool, Tool]:
    half, radius = 0.5 * float(setting["learning_length"]), 0.5 * float(setting["learning_thickness"])
    shape = Ellipsoid((half, radius, radius))

    def build(name: str, made_of: str, looks_like: str) -> Tool:
        known = {"w": wood, "s": steel}
        parts = [
            Component(shape, _translate((2 * place + 1) * half), known[made], known[seen])
            for place, (made, seen) in enumerate(zip(made_of, looks_like, strict=True))
        ]
        return Tool(name, tuple(parts))

    return build("steel_far", "wws", "wws"), build("steel_near", "sww", "sww"), build("decoy", "sww", "wws")


def build_novel(setting: Setting, wood: Material, steel: Material) -> Tool:
    """Builds the novel tool from a wooden and a steel part, with a bend at their joint and grips at both ends."""
    unequal = str(setting["novel_parts"]) == "unequal"
    length, bend = float(setting["novel_length"]), float(setting["novel_bend"])
    share = float(setting["novel_share"]) if unequal else 0.5
    ratio = float(setting["novel_thickness_ratio"]) if unequal else 1.0
    radius = 0.5 * float(setting["novel_thickness"])
    first, second = share * length, (1.0 - share) * length
    X_TJ = _translate(first) @ _turn(bend)  # J is at the joint between the parts, along the steel part
    handle = Component(Ellipsoid((0.5 * first, radius, radius)), _translate(0.5 * first), wood, wood)
    thick = ratio * radius
    head = Component(Ellipsoid((0.5 * second, thick, thick)), X_TJ @ _translate(0.5 * second), steel, steel)
    by_steel = X_TJ @ _translate(second) @ _turn(math.pi)
    return Tool("novel tool", (handle, head), (Grip("wood", np.eye(4)), Grip("steel", by_steel)))


def _build_path(setting: Setting, path: TimedPath) -> TimedPath:
    turn, scale = _turn(float(setting["path_turn"]))[:3, :3], float(setting["path_scale"])
    points = scale * np.array(path.points) @ turn.T
    points[:, 2] += float(setting["path_rise"]) * np.arange(1, len(points) + 1) / len(points)
    chord = points[-1, :2] / max(float(np.linalg.norm(points[-1, :2])), 1e-9)
    points[len(points) // 2, :2] += float(setting["path_bow"]) * np.array([-chord[1], chord[0]])
    return replace(
        path,
        points=tuple((float(x), float(y), float(z)) for x, y, z in points),
        duration=float(setting["path_duration"]),
        start=_move_start(setting, path.start),
    )


def _build_hammer(setting: Setting, hammer: Hammer) -> Hammer:
    force = float(setting["nail_force"])
    return replace(
        hammer,
        nail=replace(hammer.nail, depth_demanded=force / hammer.nail.stiffness),
        offset=(float(setting["nail_forward"]), hammer.offset[1], float(setting["nail_height"])),
        duration=float(setting["swing_duration"]),
        force=force,
        start=_move_start(setting, hammer.start),
    )


def _move_start(setting: Setting, start: Start) -> Start:
    moved: Mapping[str, float] = {
        "shoulder_azimuth": float(setting["start_azimuth"]),
        "shoulder_elevation": float(setting["start_elevation"]),
        "elbow_flexion": float(setting["start_elbow"]),
    }
    return tuple((name, angle + moved.get(name, 0.0)) for name, angle in start)


def _translate(x: float) -> Array:
    X = np.eye(4)
    X[0, 3] = x
    return X


def _turn(angle: float) -> Array:
    """Builds a pose that is rotated about z by an angle, (4, 4)."""
    X = np.eye(4)
    X[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return X
