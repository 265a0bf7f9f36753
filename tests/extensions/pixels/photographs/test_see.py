"""Measuring objects in ray-cast pictures whose truth is known."""

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadArgumentError, NoDepthError, NothingSeenError, TooSmallError
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.example import CANS, cast_example
from affordance.extensions.pixels.photographs.ray_scene import (
    ScenePart,
    box_gauge,
    cast_scene,
    cylinder_gauge,
    look_at,
    spoil,
)
from affordance.extensions.pixels.photographs.see import see
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.objects.load import load_tools
from affordance.objects.tool_entries import build_pose
from studies.pictures.scenes import draw_scene

CAMERA = PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5)
HALF = (0.03, 0.05, 0.04)


def build_box(at=(0.0, 0.0), half=HALF, turn=30.0, colour=(0.2, 0.4, 0.7)):
    X = build_pose([*at, half[2]], (0.0, 0.0, turn))
    return ScenePart(box_gauge(half, X), X[:3, 3], 1.1 * float(np.linalg.norm(half)), colour)


def cast(parts, camera=CAMERA, X_WC=None, **options):
    X_WC = look_at(0.6, 0.7) if X_WC is None else X_WC
    picture, shown = cast_scene(parts, camera, X_WC)
    return spoil(picture, shown, camera, np.random.default_rng(0), **options), shown


def test_depth_of_a_box_is_where_rays_meet_its_planes():
    X_WC = look_at(0.6, 0.5 * np.pi - 1e-6)  # from above
    picture, shown = cast_scene([build_box(turn=0.0)], CAMERA, X_WC)
    assert picture.depth[120, 160] == pytest.approx(0.6 - 2.0 * HALF[2], abs=1e-6)
    assert picture.depth[5, 5] == pytest.approx(0.6, abs=1e-4)
    width = (shown[120] == 0).sum() / 300.0 * (0.6 - 2.0 * HALF[2])
    assert width == pytest.approx(2.0 * HALF[0], abs=0.004)


@pytest.mark.parametrize("gloss", [0.0, 0.2])
def test_volume_place_and_size_of_a_box(gloss):
    picture, _ = cast([build_box()], gloss=gloss)
    seen = see(picture.colour, picture.depth, CAMERA)
    truth = 8.0 * np.prod(HALF)
    assert abs(np.log(seen.volume / truth)) < 1.645 * seen.volume_sd
    assert seen.volume == pytest.approx(truth, rel=0.25)
    (part,) = seen.parts
    X_WC = look_at(0.6, 0.7)
    p_C = X_WC[:3, :3].T @ (np.array([0.0, 0.0, HALF[2]]) - X_WC[:3, 3])
    found = seen.X_CW[:3, :3] @ part.solid.X_WS[:3, 3] + seen.X_CW[:3, 3]
    assert np.linalg.norm(found - p_C) < 3.0 * part.place_sd
    assert seen.is_good_fit
    assert not seen.doubts


def test_perfect_depth_of_a_cylinder_gives_its_volume():
    X = build_pose([0.0, 0.0, 0.05])
    part = ScenePart(cylinder_gauge(0.035, 0.05, X), X[:3, 3], 0.09, (0.7, 0.3, 0.2))
    picture, _ = cast([part], noise=SensorNoise(depth_scale=0.0))
    seen = see(picture.colour, picture.depth, CAMERA)
    assert seen.volume == pytest.approx(np.pi * 0.035**2 * 0.1, rel=0.1)


def test_turned_camera_and_doubled_resolution_measure_the_same():
    volumes = []
    double = PinholeCamera(640, 480, 600.0, 600.0, 319.5, 239.5)
    for camera, roll in ((CAMERA, 0.0), (CAMERA, 0.3), (double, 0.0)):
        X_WC = look_at(0.6, 0.7) @ build_pose([0.0, 0.0, 0.0], (0.0, 0.0, np.degrees(roll)))
        picture, _ = cast([build_box()], camera, X_WC)
        volumes.append(see(picture.colour, picture.depth, camera).volume)
    assert max(volumes) / min(volumes) < 1.2


def test_pixel_and_mask_choose_the_object():
    parts = [build_box(), build_box((0.13, 0.08), (0.02, 0.02, 0.03), 0.0)]
    picture, shown = cast(parts)
    rows, columns = np.nonzero(shown == 1)
    at = (float(columns.mean()), float(rows.mean()))
    for chosen in ({"at": at}, {"mask": shown == 1}):
        seen = see(picture.colour, picture.depth, CAMERA, **chosen)
        assert abs(np.log(seen.volume / (8.0 * 0.02 * 0.02 * 0.03))) < 1.645 * seen.volume_sd
    assert see(picture.colour, picture.depth, CAMERA).volume > 3.0 * seen.volume


def test_touching_boxes_of_two_heights_are_doubted():
    parts = [build_box((0.0, 0.0), (0.03, 0.03, 0.07), 0.0), build_box((0.075, 0.0), (0.045, 0.03, 0.015), 0.0)]
    picture, _ = cast(parts)
    seen = see(picture.colour, picture.depth, CAMERA)
    assert not seen.is_good_fit
    assert "two things may touch" in seen.doubts[0]


def test_hammer_has_two_parts_of_its_colours_and_a_can_has_one(tmp_path):
    picture, camera = cast_example("hammer")
    seen = see(picture.colour, picture.depth, camera)
    handle, head = seen.parts
    assert handle.colour[0] > head.colour[0] + 0.1
    assert abs(np.log(head.solid.volume / (8.0 * 0.018 * 0.05 * 0.018))) < 1.645 * head.volume_sd
    assert seen.length == pytest.approx(0.256, abs=0.02)
    path = seen.write(tmp_path, "hammer", ("oak", "steel"))
    (tool,) = load_tools(path)
    assert [part.material.name for part in tool.components] == ["oak", "steel"]
    assert tool.components[0].X_TE[0, 3] < 0.0
    assert tool.components[1].X_TE[0, 3] > 0.05
    assert [grip.X_TG[0, 3] for grip in tool.grips] == pytest.approx(
        [-0.5 * seen.length, 0.5 * seen.length], abs=1e-4
    )


def test_written_tool_has_the_volume_and_the_errors(tmp_path):
    picture, camera = cast_example("can")
    seen = see(picture.colour, picture.depth, camera)
    radius, height, _ = CANS["can"]
    assert abs(np.log(seen.volume / (np.pi * radius**2 * height))) < 1.645 * seen.volume_sd
    (tool,) = load_tools(seen.write(tmp_path, "can", ("holds_liquid",)))
    (part,) = tool.components
    assert part.shape.volume == pytest.approx(seen.volume, rel=1e-4)
    assert part.volume_sd == pytest.approx(seen.volume_sd, abs=1e-3)
    assert part.place_sd == pytest.approx(seen.parts[0].place_sd, abs=1e-4)


def test_intervals_hold_the_truth_in_random_scenes():
    """Nine scenes of the study; of 100, 90 are expected inside."""
    inside = 0
    for number in range(9):
        scene = draw_scene(1000, number)
        seen = see(scene.picture.colour, scene.picture.depth, scene.camera, at=scene.at)
        inside += abs(np.log(seen.volume / scene.volume)) < 1.645 * seen.volume_sd
    assert inside >= 6


def test_pictures_without_an_object_or_of_another_size_are_refused():
    picture, _ = cast([])
    assert "nothing stands on the table" in refuse(see, picture.colour, picture.depth, CAMERA, error=NothingSeenError)
    picture, shown = cast([build_box()])
    said = refuse(see, picture.colour, picture.depth, CAMERA, at=(10.0, 230.0), error=NothingSeenError)
    assert "pixel (10, 230) shows no object above the table; the nearest one is at" in said
    few = np.zeros(shown.shape, dtype=bool)
    few[120, 150:160] = True
    assert "has 10 pixels" in refuse(see, picture.colour, picture.depth, CAMERA, mask=few, error=TooSmallError)
    nothing = np.zeros(shown.shape)
    assert "fewer than 500 readings" in refuse(see, picture.colour, nothing, CAMERA, error=NoDepthError)
    small = picture.colour[:100]
    assert "has the shape (100, 320, 3)" in refuse(see, small, picture.depth, CAMERA, error=BadArgumentError)


def test_object_at_the_edge_is_doubted():
    picture, shown = cast([build_box((-0.33, 0.0))])
    rows, columns = np.nonzero(shown == 0)
    assert columns.min() == 0
    seen = see(picture.colour, picture.depth, CAMERA, at=(float(columns.mean()), float(rows.mean())))
    assert any("edge of the picture" in doubt for doubt in seen.doubts)


def test_one_reading_less_hardly_changes_the_measurement():
    """A pixel may be read on one processor and not on another, by rounding."""
    picture, camera = cast_example("decoy")
    whole = see(picture.colour, picture.depth, camera)
    row, column = np.argwhere(whole.mask & np.isfinite(picture.depth))[100]
    depth = picture.depth.copy()
    depth[row, column] = 0.0
    assert see(picture.colour, depth, camera).volume == pytest.approx(whole.volume, rel=0.03)
