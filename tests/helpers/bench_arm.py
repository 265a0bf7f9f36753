"""A six-joint arm for tests, as URDF and as MJCF, whose texts can be exchanged; both describe the same arm."""

from pathlib import Path

# Name, origin in the parent, axis, effort, mass, centre of mass, moments and products of inertia of each link.
_LINKS = (
    ("s", "0 0 0.15", "0 0 1", 150, 3.7, "0 -0.02 0.06", (0.011, 0.012, 0.008, 0.0006, -0.0004, 0.0003)),
    ("u", "0 0.12 0", "0 1 0", 150, 8.4, "0.21 0 0.12", (0.02, 0.24, 0.23, 0.001, 0.002, 0.0)),
    ("f", "0.42 0 0", "0 1 0", 120, 2.3, "0.19 0 0.02", (0.004, 0.055, 0.054, 0.0, 0.001, 0.0004)),
    ("w1", "0.39 0 0", "0 1 0", 28, 1.2, "0 0.09 0.01", (0.0021, 0.0018, 0.0019, 0.0, 0.0, 0.0002)),
    ("w2", "0 0.1 0", "0 0 1", 28, 1.2, "0 0.01 0.08", (0.0021, 0.0019, 0.0018, 0.0, 0.0, 0.0)),
    ("w3", "0 0 0.095", "1 0 0", 28, 0.4, "0.03 0 0", (0.0002, 0.00017, 0.00016, 0.0, 0.0, 0.0)),
)


def build_bench_urdf(*changes: tuple[str, str]) -> str:
    """Builds the arm's URDF, with texts exchanged."""
    parts, parent = ['<robot name="bench"><link name="pedestal"/>'], "pedestal"
    for name, place, axis, effort, mass, com, moments in _LINKS:
        inertia = " ".join(
            f'{key}="{value}"' for key, value in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), moments, strict=True)
        )
        parts.append(
            f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
            f"<inertia {inertia}/></inertial>"
            f'</link><joint name="j_{name}" type="revolute">'
            f'<parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/>'
            f'<limit lower="-2.9" upper="2.9" effort="{effort}" velocity="3.1"/></joint>'
        )
        parent = name
    parts.append(
        '<link name="flange"/><joint name="j_flange" type="fixed"><parent link="w3"/><child link="flange"/>'
        '<origin xyz="0.09 0 0"/></joint></robot>'
    )
    return _exchange("".join(parts), changes)


def build_bench_mjcf(*changes: tuple[str, str]) -> str:
    """Builds the arm's MJCF, with texts exchanged."""
    parts = ['<mujoco model="bench"><compiler angle="radian"/><worldbody><body name="pedestal">']
    for name, place, axis, effort, mass, com, moments in _LINKS:
        written = " ".join(map(str, moments))
        parts.append(
            f'<body name="{name}" pos="{place}"><inertial pos="{com}" mass="{mass}" fullinertia="{written}"/>'
            f'<joint name="j_{name}" axis="{axis}" range="-2.9 2.9" actuatorfrcrange="-{effort} {effort}"/>'
        )
    parts.append('<site name="flange" pos="0.09 0 0"/>' + "</body>" * len(_LINKS) + "</body></worldbody></mujoco>")
    return _exchange("".join(parts), changes)


def _exchange(text: str, changes: tuple[tuple[str, str], ...]) -> str:
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def write_bench(folder: Path, *changes: tuple[str, str], mjcf: bool = False) -> Path:
    """Writes the arm to a file."""
    path = folder / ("bench.xml" if mjcf else "bench.urdf")
    path.write_text(build_bench_mjcf(*changes) if mjcf else build_bench_urdf(*changes))
    return path
