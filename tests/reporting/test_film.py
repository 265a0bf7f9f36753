"""Films: every picture shows each arm where it is at that time."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from PIL import Image, ImageSequence

from affordance.reporting.film import check_film, write_film
from affordance.reporting.replay import Replay, Scene

WIDTH, ABOVE = 290, 72  # of a picture, and of clock and title above it, [px]


@pytest.fixture
def replay(weight, arm):
    """Two scenes of 0.4 s: in the first the hand sinks, by a turn of the second joint, in the other it stays."""
    times = np.linspace(0.0, 0.4, 41)
    still = arm.home + np.zeros((41, 7))
    sinking = still.copy()
    sinking[:, 1] += times
    first, second = weight.tools[:2]
    scenes = [Scene(first, times, sinking, "sinks"), Scene(second, times, still, "stays")]
    return Replay(weight.settings.arm, "two scenes", scenes)


@pytest.mark.usefixtures("fine")
def test_a_film_shows_every_scene_at_the_same_time(tmp_path, replay):
    """0.25 s, twice slower, are 7 pictures at 12 per second; the arm that moves changes from each to the next."""
    path = tmp_path / "film.gif"
    write_film(path, replay, seconds=0.25, slower=2.0)
    with Image.open(path) as film:
        frames = np.array([np.asarray(each.convert("RGB"), dtype=int) for each in ImageSequence.Iterator(film)])
    assert frames.shape[0] == 7
    assert frames.shape[2] == 2 * WIDTH
    pictures = frames[:, ABOVE:]
    changes = np.abs(np.diff(pictures, axis=0)).max(axis=3) > 60
    moving, still = (changes[:, :, first : first + WIDTH].sum(axis=(1, 2)) for first in (0, WIDTH))
    assert (moving > 10).all()
    assert still.sum() < 0.05 * moving.sum()  # a GIF has 256 colours for each picture, so that edges vary
    red, green, _ = np.moveaxis(pictures[0], -1, 0)
    assert (red - green > 60)[:, WIDTH:].any(axis=0).sum() > 30  # the line that is asked for, from left to right
    assert [each.name for each in tmp_path.iterdir()] == ["film.gif"]


def test_other_formats_name_the_command_that_brings_them(tmp_path, replay, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    check_film(tmp_path / "film.gif")
    for name in ("film.webm", "film.mp4"):
        message = refuse(check_film, tmp_path / name)
        assert name in message
        assert "pip install imageio-ffmpeg" in message
    assert "must be one of .gif, .webm, .mp4" in refuse(check_film, tmp_path / "film.avi")


@pytest.mark.usefixtures("fine")
@pytest.mark.parametrize(("suffix", "codec"), [(".webm", "vp9"), (".mp4", "h264")])
def test_films_by_ffmpeg_are_of_the_codec_that_browsers_play(tmp_path, replay, suffix, codec):
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    path = tmp_path / f"film{suffix}"
    write_film(path, replay, seconds=0.2, slower=1.0)
    said = subprocess.run([ffmpeg, "-i", path], capture_output=True, text=True, check=False).stderr
    assert f"Video: {codec}" in said


def test_a_name_with_a_colon_is_a_file_for_ffmpeg_too(tmp_path, replay, monkeypatch):
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "http:").mkdir()
    write_film(Path("http://film.mp4"), replay, seconds=0.2, slower=1.0)
    assert (tmp_path / "http:" / "film.mp4").stat().st_size > 0
