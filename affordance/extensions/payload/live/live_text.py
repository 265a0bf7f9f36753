"""Formats the events of a stream as text, one line each.

A final answer is followed by its doubts and by lines for the controller.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from affordance.extensions.payload.live.live_identifier import LiveEvent
from affordance.extensions.payload.payload_setting import format_payload
from affordance.extensions.payload.payload_text import give_answer_line
from affordance.extensions.robots.recorded_arm import Flange

_ENOUGH_RUNS = 3


def describe_event(event: LiveEvent, flange: Flange | str, start: float) -> str:
    """Formats an event, with the time since the first sample.

    Args:
        event: Event to format.
        flange: Flange frame for the lines for the controller, or the reason why it is unknown.
        start: Time stamp of the first sample, [s].
    """
    return "\n".join(
        f"{event.time - start:7.1f} s  {line}" if i == 0 else line
        for i, line in enumerate(_describe(event, flange, start))
    )


def _describe(event: LiveEvent, flange: Flange | str, start: float) -> Iterator[str]:
    c = event.content
    if event.kind == "ready":
        few = "" if c["empty_runs"] >= _ENOUGH_RUNS else ": three of 15 s with different motions give a better model"
        runs = "1 empty run" if c["empty_runs"] == 1 else f"{c['empty_runs']} empty runs"
        yield f"ready: {runs}{few}; the empty hand weighs 0 +- {1e3 * c['empty_hand_kg']:.0f} g"
    elif event.kind == "belief":
        yield f"{_show_mass(c)}{_show_centre(c)}; {'enough' if c['enough'] else 'not yet enough'}: {c['why']}"
    elif event.kind in ("taken up", "put down", "exchanged", "disturbed"):
        yield f"{event.kind.upper()} at {c['since'] - start:.1f} s: {_show_mass(c)}"
        if "why" in c:
            yield f"  {c['why']}"
    elif event.kind == "gap":
        yield f"gap: no sample for {c['seconds']:.2f} s; the estimate starts again"
    elif event.kind == "controller":
        centre = ", ".join(f"{1e3 * x:.0f}" for x in c["com_m"])
        new = "is now" if c["changed"] else "is"
        yield f"on the controller {c['mass_kg']:.3f} kg at ({centre}) mm {new} set; {c['why']}"
    elif event.kind == "final":
        yield from _describe_final(event, flange)
    else:
        yield f"{event.kind}: {c['why']}"


def _describe_final(event: LiveEvent, flange: Flange | str) -> Iterator[str]:
    c, belief = event.content, event.belief
    if belief is None:
        yield "FINAL: refused"
        yield from (f"  {doubt}" for doubt in c["doubts"])
        return
    yield f"FINAL: {give_answer_line(belief, flange)}"
    yield from (f"  {doubt}" for doubt in belief.doubts)
    if not belief.is_trusted or belief.setting is None:
        return
    if isinstance(flange, str):
        yield f"  no lines, because {flange}"
        return
    yield "  For the controller, while the arm stands; nothing was sent to it:"
    for robot, line in format_payload(belief.setting.express(flange.X_FT), flange.name).items():
        yield f"  {robot}:\n    {line}"


def _show_mass(c: Mapping[str, Any]) -> str:
    low, high = c["mass_interval90"]
    return f"{c['mass_kg']:.3f} kg [{low:.3f}, {high:.3f}]"


def _show_centre(c: Mapping[str, Any]) -> str:
    if c["holds"] != "something":
        return f", {c['holds']}"
    ends = ", ".join(
        f"{1e3 * x:.0f} [{1e3 * a:.0f}, {1e3 * b:.0f}]"
        for x, (a, b) in zip(c["com_m"], c["com_interval90"], strict=True)
    )
    return f", centre of mass {ends} mm"
