"""Text of an identified payload, as it is read: verdict, payload, materials, claim, assumptions, lines to paste."""

from collections.abc import Iterator, Mapping

from affordance.identification.payload_claim import ClaimVerdict
from affordance.identification.payload_formats import PayloadSetting, format_payload
from affordance.identification.posterior.marginals import UNITS
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.robots.flange import Flange

_NAMES = ("mass", "centre of mass x", "y", "z", "Ixx about it", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_VERDICTS = {"right": "is right", "wrong": "is wrong", "open": "may be right or wrong, the run cannot tell"}


def describe_payload(
    belief: PayloadBelief,
    claim: tuple[PayloadSetting, ClaimVerdict] | None,
    flange: Flange | str,
    *,
    materials: Mapping[str, Colour],
    taught: str,
    anyway: bool,
) -> str:
    """Writes a belief for a terminal, with the verdict on a claimed payload, and what a memory has learned.

    Claim and lines are in the frame of the flange; a text in its place says why there are none. Densities are named
    by the materials of their colours. Of a result that is not to be trusted, lines for the robot are written only if
    ``anyway``.
    """
    blocks = [_give_verdict(belief), _tabulate(belief)]
    if (halves := belief.halves) is not None:
        masses = ", ".join(f"{mass:.3f} +- {sd:.3f}" for mass, sd in zip(halves.mass, halves.sd, strict=True))
        blocks.append(f"gains from one half, the mass of the other: {masses} kg (weighed {belief.reference_mass:g})")
    blocks += _list("Not seen", belief.unseen)
    learned = [
        f"{_name_colour(each.colour, materials)}: {each.median:.0f} kg/m^3, 90 % from "
        f"{each.interval90[0]:.0f} to {each.interval90[1]:.0f}"
        for each in belief.learned
    ]
    blocks += _list("Densities", [*learned, *([taught] if taught else [])])
    if claim is not None and not isinstance(flange, str):
        blocks.append(_compare(belief, *claim, flange))
    blocks += _list("Found", belief.notes)
    blocks += _list("Assumed", belief.assumptions)
    blocks.append(_write_lines(belief, flange, anyway))
    return "\n\n".join(blocks)


def _name_colour(colour: Colour, materials: Mapping[str, Colour]) -> str:
    """Names the materials of a colour, as "oak #b07a45"."""
    names = [name for name, own in materials.items() if is_same_colour(own, colour)]
    return " ".join([*([" or ".join(names)] if names else ["colour"]), show_colour(colour)])


def _give_verdict(belief: PayloadBelief) -> str:
    lines = [f"{belief.source}: {belief.analysis}"]
    if belief.doubts:
        lines += ["NOT TO BE TRUSTED:", *(f"  {doubt}" for doubt in belief.doubts)]
    elif not belief.shows_mass:
        low, high = belief.mass_interval90
        lines.append(f"NOT SEEN: the mass, 90 % from {low:.2g} to {high:.2g} kg.")
        lines.append(f"  to see it: {belief.advice}")
    else:
        lines.append("No reason was found to distrust the result.")
    lines += [f"  warning: {warning}" for warning in belief.warnings]
    return "\n".join(lines)


def _tabulate(belief: PayloadBelief) -> str:
    m = belief.marginals
    lines = [
        f"In the frame {belief.tip}:",
        f"{'':18} {'mean':>11} {'SD':>10}   {'50 % interval':^23} {'90 % interval':^23}",
    ]
    for i, (name, unit) in enumerate(zip(_NAMES, UNITS, strict=True)):
        intervals = f"{m.low50[i]:11.5g} {m.high50[i]:11.5g} {m.low90[i]:11.5g} {m.high90[i]:11.5g}"
        lines.append(f"{name:18} {m.mean[i]:11.5g} {m.sd[i]:10.3g}   {intervals} {unit}")
    return "\n".join(lines)


def _list(title: str, sentences: list[str] | tuple[str, ...]) -> Iterator[str]:
    if sentences:
        yield "\n".join([f"{title}:", *(f"  {sentence}" for sentence in sentences)])


def _compare(belief: PayloadBelief, setting: PayloadSetting, verdict: ClaimVerdict, flange: Flange) -> str:
    def show(payload: PayloadSetting) -> str:
        return f"{payload.mass:.3f} kg at ({', '.join(f'{value:.4f}' for value in payload.centre_of_mass)}) m"

    found = PayloadSetting(belief.mass, belief.centre_of_mass).express(flange.X_FT)
    mark = ", NOT TO BE TRUSTED" if belief.doubts else ""
    errors = ", ".join(
        f"{name} {error:.2g}" for name, error in zip(belief.channel_names, verdict.torque_error, strict=True)
    )
    return "\n".join(
        [
            f"Claimed{mark}: the payload that is set {_VERDICTS[verdict.verdict]} (right with probability "
            f"{verdict.probability:.2f}: mass to {verdict.mass_tolerance:.3f} kg, first moment to "
            f"{verdict.moment_tolerance:.4f} kg m)",
            f"  set, in the frame {flange.name}: {show(setting)}",
            f"  found, in the same frame: {show(found)}",
            f"  largest errors of torque in this run with the setting (N m): {errors}",
        ]
    )


def _write_lines(belief: PayloadBelief, flange: Flange | str, anyway: bool) -> str:
    if belief.doubts and not anyway:
        return "For the robot: no lines, as the result is not to be trusted (--anyway writes them)."
    if belief.setting is None:
        why = "little or nothing is held" if belief.is_light else "the mass was not seen"
        return f"For the robot: no lines, as {why}."
    if isinstance(flange, str):
        return f"For the robot: no lines, as {flange}."
    mark = ", NOT TO BE TRUSTED" if belief.doubts else ""
    lines = [f"For the robot, with {flange.name} as its flange (--flange names another frame){mark}:"]
    payload = belief.setting.express(flange.X_FT)
    return "\n".join(
        [*lines, *(f"  {robot}: {line}" for robot, line in format_payload(payload, flange.name).items())]
    )
