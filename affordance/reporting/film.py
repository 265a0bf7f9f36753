"""Writes films that show an arm with several objects side by side."""

from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.text import Text

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.atomic import write_atomic
from affordance.plant.load import load_arm
from affordance.reporting.formatting import fold
from affordance.reporting.renderings import Pose, render_poses
from affordance.reporting.replay import Replay, find_held_height, slow_down

# Codecs of films that FFmpeg writes, by suffix. A GIF needs no codec.
_CODECS = {".webm": "libvpx-vp9", ".mp4": "libx264"}
_RATE, _PAUSE = 12, 1.5  # pictures per second, and the pause before the film begins again, [s]
_PIXELS, _DPI = 290, 100  # width of each picture of the arm
_TITLE, _VERDICT, _CLOCK = 0.42, 0.26, 0.3  # heights, [inches]
_WIDTH = 42  # width of a picture's title, [characters]
_LEVEL = 0.005  # largest distance from the goal at which the goal is reached, [m]


def check_film(path: Path) -> None:
    """Checks that a film with this suffix can be written.

    Raises:
        BadValueError: The suffix is unknown, or FFmpeg is needed but missing.
    """
    if path.suffix not in (".gif", *_CODECS):
        raise BadValueError("FILE", "suffix", describe_choice(path.suffix, (".gif", *_CODECS)))
    if path.suffix in _CODECS:
        _find_ffmpeg(path)


def write_film(path: Path, replay: Replay, *, seconds: float, slower: float) -> None:
    """Writes a film that shows all scenes side by side.

    Args:
        path: File to write. Its suffix selects GIF, WebM or MP4 (H.264).
        replay: Scenes to show.
        seconds: Duration that is shown, from the start of each scene, [s].
        slower: Slow-motion factor.
    """
    scenes = [slow_down(scene) for scene in replay.scenes]
    seconds = min(seconds, max(float(scene.times[-1]) for scene in scenes))
    times = np.linspace(0.0, seconds, max(2, round(seconds * slower * _RATE) + 1))
    poses, verdicts = [], []
    for scene in scenes:
        for row in np.minimum(np.searchsorted(scene.times, times), len(scene.times) - 1):
            verdicts.append("" if scene.height is None else _compare_height(float(scene.height[row])))
            travel = 0.0 if scene.travel is None else float(scene.travel[row])
            poses.append(Pose(scene.tool, scene.placement, scene.q[row], travel))
    has_nail = any(scene.placement is not None for scene in scenes)
    p_WG = replay.p_WG if has_nail or replay.p_WG is not None else _compute_height_line(replay.directives)
    images = render_poses(replay.directives, poses, width=_PIXELS, p_WG=p_WG)
    columns = len(scenes) if len(scenes) < 4 else (len(scenes) + 1) // 2
    rows = -(-len(scenes) // columns)
    high, wide = np.array(images[0].shape[:2]) / _DPI
    below = _VERDICT if any(verdicts) else 0.0
    tile = _TITLE + high + below
    figure = Figure(figsize=(columns * wide, rows * tile + _CLOCK), dpi=_DPI)
    shown: list[AxesImage] = []
    texts: list[Text] = []
    for number, scene in enumerate(scenes):
        row, column = divmod(number, columns)
        top = (row * tile + _TITLE + _CLOCK) / figure.get_figheight()
        share = high / figure.get_figheight()
        axes = figure.add_axes((column / columns, 1.0 - top - share, 1.0 / columns, share))
        axes.axis("off")
        axes.set_title(fold(scene.caption, _WIDTH), fontsize=9, parse_math=False)
        shown.append(axes.imshow(images[number * len(times)], interpolation="nearest", aspect="auto"))
        foot = 1.0 - top - share - below / figure.get_figheight()
        texts.append(figure.text((column + 0.5) / columns, foot, "", ha="center", va="bottom", fontsize=10))
    pace = f", {slower:g} times slower" if slower != 1.0 else ""
    clock = figure.text(0.01, 1.0 - 0.2 / figure.get_figheight(), "", fontsize=9, parse_math=False)

    def show(frame: int) -> list[AxesImage]:
        k = min(frame, len(times) - 1)
        for number, (image, text) in enumerate(zip(shown, texts, strict=True)):
            image.set_data(images[number * len(times) + k])
            text.set_text(verdicts[number * len(times) + k])
        clock.set_text(f"{replay.title}: {times[k]:.2f} s{pace}; red line: the goal")
        return shown

    film = FuncAnimation(figure, show, frames=len(times) + round(_PAUSE * _RATE), blit=False)
    write_atomic(path, partial(_save, film))


def _compare_height(height: float) -> str:
    """Describes a height above the goal, [m]."""
    if abs(height) < _LEVEL:
        return "at the goal"
    return f"{100.0 * abs(height):.0f} cm {'above' if height > 0.0 else 'below'} the goal"


def _save(film: FuncAnimation, path: Path) -> None:
    writer: AbstractMovieWriter = PillowWriter(fps=_RATE)
    if path.suffix in _CODECS:
        matplotlib.rcParams["animation.ffmpeg_path"] = _find_ffmpeg(path)
        even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p"]
        writer = FFMpegWriter(fps=_RATE, codec=_CODECS[path.suffix], extra_args=even)
    film.save(path.absolute(), writer=writer)  # absolute, because FFmpeg interprets "NAME:" as a protocol


def _find_ffmpeg(path: Path) -> str:
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError as error:
        problem = f"is {path}, which needs FFmpeg: pip install imageio-ffmpeg (a .gif does not need it)"
        raise BadValueError("FILE", "", problem) from error
    return str(get_ffmpeg_exe())


def _compute_height_line(directives: Path) -> Array:
    """Computes the ends of a line at the goal height, (2, 3), [m]."""
    arm = load_arm(directives)
    context = arm.plant.CreateDefaultContext()
    arm.set_posture(context, arm.home)
    base = arm.plant.get_joint_actuator(arm.plant.GetJointActuatorIndices()[0]).joint().frame_on_parent()
    return find_held_height(*(each.CalcPoseInWorld(context).translation() for each in (base, arm.hand)))
