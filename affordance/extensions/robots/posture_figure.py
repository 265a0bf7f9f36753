"""Figure of an imported arm in its home posture: rendering, joints, and hand frame with a tool."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.exceptions import UnavailableError
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.reporting.figures import OBJECT_COLOURS, tidy
from affordance.reporting.object_drawings import Drawing, compute_limits, draw_object
from affordance.reporting.renderings import Pose, render_poses

_WIDTH, _HEIGHT = 720, 540
# Tool that shows how objects are held; length of the drawn axes, [cm]; shortest drawn fraction of it that is visible.
_HAMMER, _ARROW, _SEEN = "claw hammer", 9.0, 0.3


def draw_posture(models: Path) -> Figure:
    """Plots the arm in its home posture: rendered with an object, its joints from two sides, and the hand frame."""
    arm = load_arm(models / ARM.name)
    tools = load_tools(models / "tools" / "weight.yaml", load_materials(models / "materials.yaml"))
    longest = max(tools[:-1], key=lambda tool: float(tool.p_TTfree[0]))
    try:
        (picture,) = render_poses(arm.source, [Pose(longest, None, arm.home)], width=_WIDTH, height=_HEIGHT)
    except UnavailableError:
        picture = np.full((_HEIGHT, _WIDTH, 3), 255, dtype=np.uint8)  # without a renderer, only the joints are drawn
    context: Any = arm.plant.CreateDefaultContext()
    joints = [arm.plant.GetJointByName(name) for name in arm.joint_names]
    hand: Any = arm.hand.CalcPoseInWorld(context)
    free = hand @ longest.p_TTfree
    places = [joint.frame_on_child().CalcPoseInWorld(context).translation() for joint in joints]
    points = np.array([*places, hand.translation()])
    figure = Figure(figsize=(15.5, 4.6), layout="constrained")
    rendered, side, above, frame = figure.subplots(1, 4, width_ratios=[1.5, 1.0, 1.0, 1.1])
    rendered.imshow(picture)
    rendered.set_axis_off()
    rendered.set_title(f"at home, with {longest.name.replace('_', ' ')}")
    for axes, row, name, label in (
        (side, 2, "from the right", "up (m)"),
        (above, 1, "from above", "to the left (m)"),
    ):
        axes.plot(points[:, 0], points[:, row], "o-", color=OBJECT_COLOURS[0], label="joints and hand")
        ends = np.array([hand.translation(), free])
        axes.plot(ends[:, 0], ends[:, row], "-", color=OBJECT_COLOURS[4], linewidth=3.0, label="object")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xlabel="forward (m)", ylabel=label, title=name)
    side.legend(frameon=False, fontsize=8)
    tidy(side, above)
    _draw_hand_frame(frame, hand.rotation().matrix())
    return figure


def _draw_hand_frame(axes: Axes, R_WH: Array) -> None:
    """Plots the hand's axes with a hammer in the hand, seen from the right: world x forward, z up."""
    hammer = next(tool for tool in load_tools(MODELS / "workshop" / "tools.yaml") if tool.name == _HAMMER)
    held = hammer.gripped_by(hammer.grips[0])
    R_VH = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) @ R_WH  # V: view along -Vz
    X_VH = np.eye(4)
    X_VH[:3, :3] = R_VH
    parts = tuple(replace(part, X_TE=X_VH @ part.X_TE) for part in held.components)
    shown = replace(held, components=parts)
    draw_object(axes, Drawing(shown, ""))
    for name, direction in zip("xyz", R_VH.T, strict=True):
        along = direction[:2]
        if np.linalg.norm(along) > _SEEN:
            end = (_ARROW * along).tolist()
            axes.annotate(
                "",
                end,
                (0.0, 0.0),
                arrowprops={"arrowstyle": "-|>", "linewidth": 2.0, "color": "#AA3377", "shrinkA": 0.0},
            )
            axes.annotate(name, (1.15 * _ARROW * along).tolist(), ha="center", va="center", color="#AA3377")
        else:
            away = "away from" if direction[2] < 0.0 else "towards"
            axes.annotate(f"{name} points {away} you", (0.0, -1.1 * _ARROW), color="#AA3377", fontsize=9)
    axes.set_title(f"the hand's frame at home, from the right,\nwith the {_HAMMER} by its {held.grip}", fontsize=10)
    low, high = compute_limits([shown])
    around = 1.3 * _ARROW * np.ones(2)
    low, high = np.minimum(low, -around), np.maximum(high, around)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.axis("off")
