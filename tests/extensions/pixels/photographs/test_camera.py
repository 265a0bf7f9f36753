"""Intrinsics from files of common programs, and what is refused."""

import json

import pytest
from helpers.refusals import refuse

from affordance.extensions.pixels.photographs.camera import read_camera

SIZE = (640, 480)
OWN = {"width": 640, "height": 480, "fx": 610.0, "fy": 611.0, "cx": 321.5, "cy": 238.0}
ROWS = [610.0, 0.0, 321.5, 0.0, 611.0, 238.0, 0.0, 0.0, 1.0]
COLUMNS = [610.0, 0.0, 0.0, 0.0, 611.0, 0.0, 321.5, 238.0, 1.0]


@pytest.fixture
def write(tmp_path):
    def write(content, name="camera.json"):
        (tmp_path / name).write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return tmp_path / name

    return write


@pytest.mark.parametrize(
    "content",
    [
        OWN,
        {
            "image_width": 640,
            "image_height": 480,
            "K": ROWS,
            "D": [0.0] * 5,
            "distortion_model": "plumb_bob",
        },  # ROS 1
        {"width": 640, "height": 480, "k": ROWS, "d": []},  # ROS 2
        {"width": 640, "height": 480, "intrinsic_matrix": COLUMNS},  # Open3D
        {"w": 640, "h": 480, "K": COLUMNS, "fps": 60},  # Record3D
        {"fx": 610.0, "fy": 611.0, "ppx": 321.5, "ppy": 238.0, "coeffs": [0.0] * 5},  # librealsense
        {"K": [ROWS[:3], ROWS[3:6], ROWS[6:]]},
        {"12": {"cam_K": ROWS, "depth_scale": 0.1}},  # BOP's scene_camera.json of a single picture
    ],
)
def test_all_forms_are_the_same_camera(write, content):
    camera = read_camera(write(content), SIZE)
    assert camera[:6] == (640, 480, 610.0, 611.0, 321.5, 238.0)
    assert camera.depth_unit == (pytest.approx(1e-4) if "12" in content else None)


def test_calibration_of_ros_in_yaml_is_read(write):
    matrix = "camera_matrix: {rows: 3, cols: 3, data: [610, 0, 321.5, 0, 611, 238, 0, 0, 1]}"
    text = f"image_width: 640\nimage_height: 480\n{matrix}\n"
    assert read_camera(write(text, "head.yaml"), SIZE)[2:6] == (610.0, 611.0, 321.5, 238.0)


def test_entry_of_a_picture_is_chosen_by_its_number(write):
    entry = {"cam_K": [2.0 * each if k in (0, 4) else each for k, each in enumerate(ROWS)]}
    path = write({"1": {"cam_K": ROWS}, "2": entry})
    assert read_camera(path, SIZE, "000002.png").fx == 1220.0
    assert "has 2 entries by picture, none for cup.png" in refuse(read_camera, path, SIZE, "cup.png")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "is no mapping, must have width, height, fx"),
        ({"fx": 610.0}, "has no fy, cx, cy; must have"),
        (OWN | {"width": 1280, "height": 960}, "is of pictures of 1280 x 960 pixels, but this one has 640 x 480"),
        (OWN | {"cx": 640.0}, "cx: is 640, must be in the middle third of 640 pixels"),
        (OWN | {"fx": 0.61}, "fx: is 0.61, must be from 50 to 20000 pixels"),
        (OWN | {"fx": "wide"}, "fx: is 'wide', must be a number greater than 0"),
        (OWN | {"D": [0.1, 0.0, 0.0, 0.0, 0.0]}, "D: is not zero: undistort both pictures first"),
        ({"K": ROWS[:4]}, "K: is [610.0, 0.0, 321.5, 0.0], must be the nine numbers"),
        ({"K": [610.0, 5.0, *ROWS[2:]]}, "must be the nine numbers"),
    ],
)
def test_other_intrinsics_are_refused(write, content, said):
    assert said in refuse(read_camera, write(content), SIZE)


def test_cropped_picture_may_have_its_centre_elsewhere(write):
    path = write(OWN | {"cx": 100.0})
    assert "--cropped" in refuse(read_camera, path, SIZE)
    assert read_camera(path, SIZE, is_cropped=True).cx == 100.0
