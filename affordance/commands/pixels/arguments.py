"""Arguments of the commands for pictures."""

import argparse
from pathlib import Path

from affordance.commands.arguments import add_json, add_seed
from affordance.commands.parser import OUTPUT, find_group


def declare_see(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``see``."""
    add = parser.add_argument
    add("colour", nargs="?", type=Path, metavar="COLOUR", help="colour picture: PNG, JPEG or TIFF")
    what = "depth picture of the same size: PNG of 16 bits, or TIFF or NPY in m"
    add("--depth", type=Path, metavar="FILE", help=what)
    what = "intrinsics in JSON or YAML: width, height, fx, fy, cx, cy; ROS camera_info; BOP, Open3D or Record3D"
    add("--camera", type=Path, metavar="FILE", help=what)
    what = "step of a depth picture in whole numbers, m (default: from the camera's file, else 0.001)"
    add("--depth-unit", type=float, metavar="M", help=what)
    add("--cropped", action="store_true", help="the picture was cropped, so that its centre moved")
    what = "column and row of a pixel that shows the object (default: the object nearest to the middle)"
    add("--at", type=float, nargs=2, metavar=("U", "V"), help=what)
    add("--mask", type=Path, metavar="FILE", help="PNG of the same size in which the object is white")
    what = "material of a solid object: a name in models/materials.yaml, or NAME,NAME for two parts"
    add("--material", metavar="NAME", help=what)
    what = "contents of the object: liquid, powder, dry_food or air (default: unknown)"
    add("--holds", choices=("liquid", "powder", "dry_food", "air"), metavar="KIND", help=what)
    what = "tools.yaml of an earlier picture of the same material, from which colours are copied"
    add("--same-colour", type=Path, metavar="FILE", help=what)
    add("--name", metavar="NAME", help="name of the object (default: name of the picture's file)")
    what = "write example pictures to a new folder, and print how to use them"
    add("--demo", type=Path, metavar="DIR", help=what)
    add_json(parser)
    what = "folder for tools.yaml, its meshes and seen.png (default: the picture's name)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, metavar="DIR", help=what)
    add_seed(parser)
