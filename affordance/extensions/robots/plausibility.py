"""Warns about implausible numbers of an arm, with likely causes. Nothing is rejected.

The bounds are physical and wide. A number beyond them has a wrong unit, is a placeholder, or is mistyped.
"""

import math
from collections.abc import Iterator

import numpy as np
from pydrake.multibody.tree import BodyIndex

from affordance.arrays import build_symmetric
from affordance.extensions.robots.description import Inertial
from affordance.extensions.robots.reduced_arm import ReducedArm, ReducedLink

# Margin for distances between joints and for centres of mass: half the width of a large industrial link, [m].
_WIDTH = 0.25
# Upper bound of a link's density: solid steel, [kg/m^3].
_STEEL = 7900.0
# Mass per length of the thinnest structure: an aluminium tube of 20 mm diameter and 1 mm wall, [kg/m].
_BARE_TUBE = 0.16
# Radius of gyration below which a link is a point mass, as a fraction of its length; a thin rod has 0.29.
_POINT = 0.01
# Ratio of radius of gyration to size above which a wrong unit is likelier than a placeholder such as 1 kg m^2.
_OTHER_UNIT = 10.0
# Least share of a link's moments at which a part merged into the link matters.
_MATTERS = 0.01
# Widest joint range, eight turns for a wrist with cables, [rad], and highest joint speed, 2900 degrees/s, [rad/s].
_WIDEST, _FASTEST = 50.0, 50.0
# If the ranges of all joints are smaller, radians were probably read as degrees: 4 pi (two turns) degrees, [rad].
_NARROW = 0.22
# Relative difference between left and right masses that exceeds rounding.
_TWIN = 0.01
# Words for left and right in a name, and letters at its beginning or end.
_WORDS = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"))
_LETTERS = (("l", "r"), ("L", "R"))


def list_implausible(arm: ReducedArm) -> list[str]:
    """Lists implausible values of links and joints, one sentence per kind."""
    return [*_list_of_links(arm), *_list_of_joints(arm), *_list_twins(arm)]


def compute_lengths(arm: ReducedArm) -> list[float]:
    """Computes the distances between successive joints, and from the last joint to the tip, [m]."""
    ends = [*(link.X_PL for link in arm.links[1:]), arm.X_LT]
    return [float(np.linalg.norm(X.translation())) for X in ends]


def is_nearly_massless(arm: ReducedArm) -> bool:
    """Returns True if an arm is lighter than the thinnest structure of its length."""
    return arm.mass < _BARE_TUBE * sum(compute_lengths(arm))


def _list_of_links(arm: ReducedArm) -> Iterator[str]:
    lengths = compute_lengths(arm)
    reach = sum(lengths)
    away, wide, placed, points, heavy = (list[str]() for _ in range(5))
    for link, length in zip(arm.links, lengths, strict=True):
        mass, p_com = link.inertial.mass, float(np.linalg.norm(link.inertial.place))
        if not mass:
            continue
        # A link may extend back to the previous joint, and to the bodies fixed to it.
        before = float(np.linalg.norm(link.X_PL.translation()))
        size = _WIDTH + max(length, before) + max(float(np.linalg.norm(X.translation())) for _, X in link.bodies)
        far = [(link.name, p_com)] if p_com > size + reach else [*_list_far_parts(arm, link, _WIDTH + reach)]
        if far:
            away += [f"{name} {distance:.3g} m" for name, distance in far]
            continue
        size += p_com
        gyration = _compute_gyration(link.inertial)
        if gyration > size:
            (wide if gyration > _OTHER_UNIT * size else placed).append(f"{link.name} {gyration:.3g} m")
        elif parts := _list_wide_parts(arm, link, size):
            placed += parts
        elif gyration < _POINT * length:
            points.append(f"{link.name} {1000.0 * gyration:.2g} mm")
        if mass > _STEEL * size**3:
            heavy.append(f"{link.name} {mass:.3g} kg")
    on_arm = f"on an arm of {reach:.3g} m"
    if away:
        yield f"centres of mass far from their joints, {on_arm}: {', '.join(away)}; are they in millimetres?"
    if wide:
        found = f"radii of gyration beyond the links, {on_arm}: {', '.join(wide)}"
        yield f"{found}; are moments of inertia in kg mm^2 or g mm^2?"
    if placed:
        yield f"radii of gyration beyond the links, {on_arm}: {', '.join(placed)}; are moments placeholders?"
    if points:
        yield f"radii of gyration like points', {on_arm}: {', '.join(points)}; are moments of inertia missing?"
    if heavy:
        yield f"links heavier than steel of their size, {on_arm}: {', '.join(heavy)}; are masses in grams?"
    if is_nearly_massless(arm):
        yield (
            f"the arm of {reach:.3g} m has {arm.mass:.2g} kg, less than a thin aluminium tube ({_BARE_TUBE:g} kg/m): "
            "are masses missing or placeholders?"
        )


def _list_far_parts(arm: ReducedArm, link: ReducedLink, reach: float) -> Iterator[tuple[str, float]]:
    """Lists merged parts whose centre of mass is farther from their own frame than the arm's reach."""
    for name, _ in link.bodies:
        part = arm.tree.description.inertials.get(name)
        if part is not None and part.mass > 0.0 and part.in_link:
            distance = float(np.linalg.norm(part.place))
            if distance > reach:
                yield name, distance


def _list_wide_parts(arm: ReducedArm, link: ReducedLink, size: float) -> list[str]:
    """Lists relevant merged parts whose radius of gyration exceeds the link's size."""
    inertials, found = arm.tree.description.inertials, []
    for name, _ in link.bodies:
        part = inertials.get(name)
        if part is None or not part.mass > 0.0 or len(link.bodies) == 1:
            continue
        gyration = _compute_gyration(part)
        if gyration > size and max(part.moments) > _MATTERS * max(link.inertial.moments):
            found.append(f"{name} {gyration:.3g} m")
    return found


def _compute_gyration(inertial: Inertial) -> float:
    """Computes the largest radius of gyration, [m]."""
    largest = np.linalg.eigvalsh(build_symmetric(inertial.moments))[-1]
    return math.sqrt(max(float(largest), 0.0) / inertial.mass)


def _list_of_joints(arm: ReducedArm) -> Iterator[str]:
    ranges = {link.joint: link.upper - link.lower for link in arm.links}
    limited = {name: width for name, width in ranges.items() if math.isfinite(width)}
    if wide := [f"{name} {width:.4g}" for name, width in limited.items() if width > _WIDEST]:
        yield f"ranges of more than {_WIDEST:g} rad: {', '.join(wide)} rad; degrees?"
    if limited and len(limited) == len(ranges) and max(limited.values()) < _NARROW:
        most = math.degrees(max(limited.values()))
        yield (
            f"no joint turns by more than {most:.2g} degrees: were radians read as degrees? "
            'An MJCF needs <compiler angle="radian"/>'
        )
    given = {"effort": arm.options.effort, "velocity": arm.options.velocity}  # not from the file
    fast = [
        f"{each.joint} {each.velocity:g}"
        for each in arm.links
        if _FASTEST < each.velocity < math.inf and not {"", each.joint} & set(given["velocity"])
    ]
    if fast:
        yield f"velocity limits of more than {_FASTEST:g} rad/s: {', '.join(fast)} rad/s; degrees, or placeholders?"
    for name, values, unit in (
        ("torque", [link.effort for link in arm.links], "N m"),
        ("velocity", [link.velocity for link in arm.links], "rad/s"),
    ):
        option = "effort" if name == "torque" else name
        if len(values) > 1 and len(set(values)) == 1 and _is_power_of_ten(values[0]) and not given[option]:
            yield f"every joint has a {name} limit of {values[0]:g} {unit}: a placeholder? --{option} overrides it"


def _is_power_of_ten(value: float) -> bool:
    return 0.0 < value < math.inf and math.log10(value).is_integer()


def _list_twins(arm: ReducedArm) -> Iterator[str]:
    """Lists links whose mass differs from their counterpart on the other side, which is found by name."""
    plant = arm.tree.plant
    masses = {
        arm.tree.key(body): float(body.default_mass())
        for body in map(plant.get_body, map(BodyIndex, range(1, plant.num_bodies())))
    }
    told: set[str] = set()
    for link in arm.links:
        for name, _ in link.bodies:
            other = next((twin for twin in _name_twins(name) if twin in masses), None)
            if other is None or name in told:
                continue
            mass, of_twin = masses[name], masses[other]
            if abs(mass - of_twin) > _TWIN * max(mass, of_twin):
                told.add(other)
                yield f"link {name} has {mass:.3g} kg, but its twin {other} has {of_twin:.3g} kg"


def _name_twins(name: str) -> Iterator[str]:
    """Lists possible names of a link's counterpart, with left and right exchanged."""
    for one, other in (*_WORDS, *(pair[::-1] for pair in _WORDS)):
        if one in name:
            yield name.replace(one, other)
    for one, other in (*_LETTERS, *(pair[::-1] for pair in _LETTERS)):
        if name.startswith(f"{one}_"):
            yield f"{other}{name[1:]}"
        if name.endswith(f"_{one}"):
            yield f"{name[:-1]}{other}"
