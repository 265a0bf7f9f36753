"""Colour and depth files: the same depth from all formats, and what is refused before it is decoded."""

import struct
import zlib

import numpy as np
import pytest
from helpers.refusals import refuse
from PIL import Image

from affordance.extensions.pixels.photographs.pictures import read_colour, read_depth, read_mask

SIZE = (64, 48)
DEPTH = np.full((48, 64), 0.8)
DEPTH[:10] = 0.0


@pytest.fixture
def write(tmp_path):
    def write(name, array):
        path = tmp_path / name
        np.save(path, array) if path.suffix == ".npy" else Image.fromarray(array).save(path)
        return path

    return write


@pytest.mark.parametrize(
    ("name", "array", "unit"),
    [
        ("mm.png", np.rint(1e3 * DEPTH).astype(np.uint16), None),
        ("tenths.png", np.rint(1e4 * DEPTH).astype(np.uint16), 1e-4),
        ("m.tiff", DEPTH.astype(np.float32), None),
        ("m.npy", DEPTH, 1e-4),  # a unit is for whole numbers
        ("mm.npy", np.rint(1e3 * DEPTH).astype(np.uint16), None),
        ("nan.npy", np.where(DEPTH > 0.0, DEPTH, np.nan), None),
    ],
)
def test_depth_is_in_metres_and_missing_is_nan(write, name, array, unit):
    depth = read_depth(write(name, array), SIZE, unit)
    np.testing.assert_allclose(depth[10:], 0.8, atol=1e-6)
    assert np.isnan(depth[:10]).all()


@pytest.mark.parametrize(
    ("name", "array", "said"),
    [
        (
            "small.png",
            np.full((24, 32), 800, np.uint16),
            "the colour picture 64 x 48, must be the same; register depth",
        ),
        (
            "grey.png",
            np.full((48, 64), 80, np.uint8),
            "has uint8 of shape (48, 64), must have one number of 16 or 32",
        ),
        ("colours.png", np.full((48, 64, 3), 80, np.uint8), "a picture of depth for the eye does not say how far"),
        (
            "far.png",
            np.full((48, 64), 9600, np.uint16),
            "9.6 m away in the median, must be from 0.1 to 5 m; --depth-unit 0.0001 or 0.0002 or 0.00025 would fit",
        ),
        (
            "mm.npy",
            np.full((48, 64), 800.0),
            "800 m away in the median, must be from 0.1 to 5 m; numbers with decimals",
        ),
        ("none.png", np.zeros((48, 64), np.uint16), "has readings in 0 % of its pixels"),
        ("objects.npy", np.array([{}]), "is no array of numbers"),
    ],
)
def test_other_depth_is_refused(tmp_path, name, array, said):
    path = tmp_path / name
    np.save(path, array, allow_pickle=True) if path.suffix == ".npy" else Image.fromarray(array).save(path)
    assert said in refuse(read_depth, path, SIZE)


def test_corrupt_and_huge_pictures_are_refused_before_they_are_decoded(tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    assert "is no readable picture" in refuse(read_colour, tmp_path / "text.png")
    body = b"IHDR" + struct.pack(">IIBBBBB", 9000, 9000, 8, 2, 0, 0, 0)
    head = struct.pack(">I", 13) + body + struct.pack(">I", zlib.crc32(body))
    (tmp_path / "bomb.png").write_bytes(b"\x89PNG\r\n\x1a\n" + head + struct.pack(">I", 8) + b"IDAT")
    assert "has 9000 x 9000 pixels, must have from 16 to 8192" in refuse(read_colour, tmp_path / "bomb.png")


def test_mask_is_white_where_the_object_is(write):
    mask = np.zeros((48, 64), np.uint8)
    assert "is black" in refuse(read_mask, write("black.png", mask), SIZE)
    mask[5:9] = 255
    assert read_mask(write("mask.png", mask), SIZE).sum() == 4 * 64
