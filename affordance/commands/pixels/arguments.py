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
    what = "m of one step of a depth picture in whole numbers (default: that of the camera's file, else 0.001)"
    add("--depth-unit", type=float, metavar="M", help=what)
    add("--cropped", action="store_true", help="the picture was cut, so that its centre is elsewhere")
    what = "pixel that shows the object, column and row (default: the object nearest to the middle)"
    add("--at", type=float, nargs=2, metavar=("U", "V"), help=what)
    add("--mask", type=Path, metavar="FILE", help="PNG of the same size, white where it shows the object")
    what = "material that it is made of, a solid: a name in models/materials.yaml; two for two parts: NAME,NAME"
    add("--material", metavar="NAME", help=what)
    what = "what it holds: liquid, powder, dry_food or air (default: unknown)"
    add("--holds", choices=("liquid", "powder", "dry_food", "air"), metavar="KIND", help=what)
    what = "tools.yaml of an earlier picture of the same material, of which its colours are taken"
    add("--same-colour", type=Path, metavar="FILE", help=what)
    add("--name", metavar="NAME", help="name of the object (default: that of the picture's file)")
    what = "write example pictures to a new folder, and print what to do with them"
    add("--demo", type=Path, metavar="DIR", help=what)
    add_json(parser)
    what = "folder for tools.yaml, its meshes and seen.png (default: the picture's name)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, metavar="DIR", help=what)
    add_seed(parser)
