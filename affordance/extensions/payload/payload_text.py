"""Formats an identified payload as text: answer, verdict, payload, materials, claims and lines to paste."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from affordance.extensions.payload.payload_claim import Claim, ClaimVerdict
from affordance.extensions.payload.payload_setting import PayloadSetting, format_payload, show_number
from affordance.extensions.payload.posterior.payload_belief import COM, UNITS, PayloadBelief
from affordance.extensions.robots.recorded_arm import Flange
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.reporting.formatting import break_line

_NAMES = ("mass", "centre x", "y", "z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
# Decimals of mass, [kg], centre of mass, [m], and moments, [kg m^2]: a tenth of a gram and of a millimetre.
_DECIMALS = (4, 4, 4, 4, *[6] * 6)
_VERDICTS = {"right": "is right", "wrong": "is wrong", "open": "may be right or wrong: the run cannot tell"}


def describe_payload(
    belief: PayloadBelief,
    claims: Sequence[Claim],
    flange: Flange | str,
    *,
    materials: Mapping[str, Colour],
    taught: str,
    anyway: bool,
    width: int = 0,
) -> str:
    """Formats an identified payload as text, with the answer in the first line.

    Args:
        belief: Posterior of the payload.
        claims: Payload settings with their verdicts.
        flange: Flange frame for claims and for lines for controllers, or the reason why it is unknown.
        materials: Colour of each known material, which names the identified densities.
        taught: Sentence about the memory that has learned from the run; empty without one.
        anyway: True to include lines for controllers even if the result is not trusted.
        width: Number of characters at which sentences are wrapped, except lines for controllers; 0 for no wrapping.
    """
    blocks = [f"{give_answer_line(belief, flange)}\n{_give_verdict(belief)}", _tabulate(belief)]
    if (halves := belief.halves) is not None:
        masses = ", ".join(f"{mass:.3f} +- {sd:.3f}" for mass, sd in zip(halves.mass, halves.sd, strict=True))
        blocks.append(
            f"Mass from each half of the run, with the gains of the other half: {masses} kg "
            f"(weighed: {belief.reference_mass:g} kg)"
        )
    blocks += _list("Not seen", belief.unseen)
    learned = [
        f"{_name_colour(each.colour, materials)}: {each.median:.0f} kg/m^3, 90 % interval "
        f"{each.interval90[0]:.0f} to {each.interval90[1]:.0f}"
        for each in belief.learned
    ]
    blocks += _list("Densities", [*learned, *([taught] if taught else [])])
    if not isinstance(flange, str):
        blocks += [_compare(belief, claim, flange) for claim in claims]
    blocks += _list("Found", belief.notes)
    blocks += _list("Assumed", belief.assumptions)
    lines = _write_lines(belief, flange, anyway)
    pasted = "\n" in lines
    text = "\n\n".join(blocks if pasted else [*blocks, lines])
    if width:
        text = "\n".join(part for line in text.splitlines() for part in break_line(line, width))
    return f"{text}\n\n{lines}" if pasted else text


def give_answer_line(belief: PayloadBelief, flange: Flange | str) -> str:
    """Formats mass, centre of mass in the flange frame, and trust, in one line."""
    if isinstance(flange, str):
        frame, payload = belief.tip, PayloadSetting(belief.mass, belief.centre_of_mass)
    else:
        frame, payload = flange.name, PayloadSetting(belief.mass, belief.centre_of_mass).express(flange.X_FT)
    trust = "NOT TO BE TRUSTED" if belief.doubts else "trusted" if belief.shows_mass else "NOT SEEN"
    if not belief.doubts and belief.is_light:
        low, high = belief.mass_interval90
        return f"Little or nothing is held, {show_number(max(low, 0.0), 3)} to {show_number(high, 3)} kg: trusted"
    grams = np.format_float_positional(1e3 * belief.mass_sd, 2, fractional=False, trim="-")
    decimals = int(np.clip(1 - np.floor(np.log10(max(belief.mass_sd, 1e-4))), 0, 4))
    centre = ", ".join(show_number(1e3 * float(value), 1) for value in payload.centre_of_mass)
    sd = np.format_float_positional(1e3 * belief.marginals.sd[COM].max(), 2, fractional=False, trim="-")
    where = f"centre of mass ({centre}) +- {sd} mm in {frame}"
    return f"{belief.mass:.{decimals}f} kg +- {grams} g, {where}: {trust}"


def _name_colour(colour: Colour, materials: Mapping[str, Colour]) -> str:
    """Names the materials of a colour, such as "oak #b07a45"."""
    names = [name for name, own in materials.items() if is_same_colour(own, colour)]
    return " ".join([*([" or ".join(names)] if names else ["colour"]), show_colour(colour)])


def _give_verdict(belief: PayloadBelief) -> str:
    lines = [f"{belief.source}: {belief.analysis}"]
    if belief.doubts:
        lines += ["NOT TO BE TRUSTED:", *(f"  {doubt}" for doubt in belief.doubts)]
    elif not belief.shows_mass:
        low, high = belief.mass_interval90
        lines.append(f"NOT SEEN: the mass (90 % interval {low:.2g} to {high:.2g} kg).")
        lines.append(f"  to see it: {belief.advice}")
    else:
        lines.append("No reason to distrust the result was found.")
    lines += [f"  warning: {warning}" for warning in belief.warnings]
    return "\n".join(lines)


def _tabulate(belief: PayloadBelief) -> str:
    m = belief.marginals
    lines = [
        f"In the frame {belief.tip}, moments about the centre of mass:",
        f"{'':9} {'mean':>9} {'SD':>9}  {'50 % interval':^19} {'90 % interval':^19}",
    ]
    for i, (name, unit, decimals) in enumerate(zip(_NAMES, UNITS, _DECIMALS, strict=True)):
        mean, *ends = (
            f"{_pad_number(float(each[i]), decimals):>9}" for each in (m.mean, m.low50, m.high50, m.low90, m.high90)
        )
        sd = np.format_float_positional(m.sd[i], 2, fractional=False, trim="-")
        lines.append(f"{name:9} {mean} {sd:>9}  {' '.join(ends)} {unit}")
    return "\n".join(lines)


def _pad_number(value: float, decimals: int) -> str:
    """Formats a value with fixed decimals, or as 0 if it rounds to zero."""
    return "0" if abs(value) < 0.5 * 10.0**-decimals else f"{value:.{decimals}f}"


def _list(title: str, sentences: list[str] | tuple[str, ...]) -> Iterator[str]:
    if sentences:
        yield "\n".join([f"{title}:", *(f"  {sentence}" for sentence in sentences)])


def _compare(belief: PayloadBelief, claim: Claim, flange: Flange) -> str:
    """Formats the verdict on a claimed payload."""
    mark, verdict = ", NOT TO BE TRUSTED" if belief.doubts else "", claim.comparison
    moment = f"first moment within {verdict.moment_tolerance:.4f} kg m"
    tolerances = f"mass within {verdict.mass_tolerance:.3f} kg, {moment}"
    found = PayloadSetting(belief.mass, belief.centre_of_mass).express(flange.X_FT)
    errors = zip(belief.channel_names, verdict.torque_error, strict=True)
    return "\n".join(
        [
            f"Claimed{mark}: the payload of {claim.file} {_VERDICTS[verdict.verdict]} "
            f"(right with probability {verdict.probability:.2f}: {tolerances}{_note_moments(verdict)})",
            f"  set, in the frame {flange.name}: {_show_setting(claim.setting)}",
            f"  found, in the same frame: {_show_setting(found)}",
            "  largest torque errors in this run with the setting (N m): "
            + ", ".join(f"{name} {error:.2g}" for name, error in errors),
        ]
    )


def _note_moments(comparison: ClaimVerdict) -> str:
    is_left_out = comparison.moments_compared is False
    return "; its moments were not compared, as the run cannot check them" if is_left_out else ""


def _show_setting(payload: PayloadSetting) -> str:
    return f"{payload.mass:.3f} kg at ({', '.join(f'{value:.4f}' for value in payload.centre_of_mass)}) m"


def _write_lines(belief: PayloadBelief, flange: Flange | str, anyway: bool) -> str:
    if belief.doubts and not anyway:
        return "For the robot: no lines, because the result is not to be trusted (--anyway writes them)."
    if belief.setting is None:
        why = "little or nothing is held" if belief.is_light else "the mass was not seen"
        return f"For the robot: no lines, because {why}."
    if isinstance(flange, str):
        return f"For the robot: no lines, because {flange}."
    mark = ", NOT TO BE TRUSTED" if belief.doubts else ""
    lines = [f"For the robot, with {flange.name} as its flange (--flange names another frame){mark}:"]
    payload = belief.setting.express(flange.X_FT)
    return "\n".join(
        [*lines, *(f"  {robot}:\n    {line}" for robot, line in format_payload(payload, flange.name).items())]
    )
