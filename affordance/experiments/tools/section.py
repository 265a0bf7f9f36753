"""Report section of the study of real tools: text, claims with their bounds, and captions."""

from affordance.exceptions import name_object
from affordance.experiments.tools.data_set import LEARNING, Half
from affordance.experiments.tools.geometry import Source
from affordance.experiments.tools.numbers import count_right, find_median_error_of_sight, list_metrics
from affordance.experiments.tools.study import Choices, ToolsResult
from affordance.experiments.tools.which_end import AFTER, ONE_DENSITY
from affordance.reporting.findings import Finding, build_section
from affordance.reporting.section import Section


def describe(result: ToolsResult) -> Section:
    """Builds the section of the report."""
    claims = _list_own_claims(result)
    text = [_describe_choices(result.own, "our own three"), _describe_uncommon(result)]
    captions = {
        "grips": "Which end of which hammer: probability that a grip is its tool's best, by belief. A star: the "
        "grip of least expected work, which is chosen, is the one that is best at true densities.",
        "uncommon": "The paper's figure 1 with two objects of ours: as seen, and what was predicted and found.",
        "holding": "The arm with each hammer in the grip that is right for driving a nail.",
        "seen": "From pictures to solids: the object in one picture, what was made of its colours, and the columns.",
    }
    if result.scores:
        claims += _list_data_claims(result)
        text.insert(0, _describe_first_touch(result))
        captions |= {
            "first_touch": "Mass before first touch against the true one, with 90 % intervals, one observer.",
            "measures": "Mean absolute error of the logarithm of mass, by geometry and number of holds.",
            "records": "Errors on the data set's own force-torque records, by noise and method.",
        }
        if result.hammers is not None:
            text.append(_describe_choices(result.hammers, "the data set's three"))
    return build_section(
        order=32,
        title="Real tools",
        summary=text[0],
        captions={f"{name}.png": caption for name, caption in captions.items()},
        findings=claims,
        remarks=text[1:],
    )


def _at_most(text: str, criterion: str, value: float, bound: float) -> Finding:
    return Finding(text, f"{criterion}, at most", bound, value, value <= bound)


def _at_least(text: str, criterion: str, value: float, bound: float) -> Finding:
    return Finding(text, f"{criterion}, at least", bound, value, value >= bound)


def _list_own_claims(result: ToolsResult) -> list[Finding]:
    blows = [blow for each in (result.own, result.hammers) if each is not None for blow in each.blows]
    misses = max(abs(blow.force / blow.force_aimed - 1.0) for blow in blows)
    works = max(abs(blow.work / blow.work_planned - 1.0) for blow in blows)
    return [
        _at_most("blows with real tools drive the nail as planned", "largest error of the peak force", misses, 0.05),
        _at_most("and at the work that was planned", "largest error of the work", works, 0.05),
    ]


def _list_data_claims(result: ToolsResult) -> list[Finding]:
    parity = list_metrics(result)["parity"]
    claims = [
        _at_most(f"meshes give the masses of {len(result.parity)} tools", "largest error", parity["mass"], 5e-3),
        _at_most("and their centres of mass", "largest error in mm", parity["com_mm"], 0.3),
        _at_most("and their rotational inertias", "largest error", parity["inertia"], 5e-3),
    ]
    for half in result.config.halves:
        which = "left out of the learning half" if half is Half.LEARNING else "of the test half"
        names = [name for name in result.truths if (name in LEARNING) == (half is Half.LEARNING)]
        for holds, bound in ((1, 0.14), (5, 0.09)):
            found = result.scores[Source.CAD, holds, half]
            after = f"after {holds} hold{'s' if holds > 1 else ''} of each learning tool"
            claims.append(_at_most(f"masses of tools {which} are known {after}", "ALDE, drawings", found.alde, bound))
            text = f"and their intervals are as wide as they should be, {after}"
            held = found.coverage_mass
            claims.append(
                Finding(text, "coverage of 90 % intervals of mass, within", (0.83, 0.97), held, 0.83 <= held <= 0.97)
            )
        if Source.TWO_VIEWS not in result.config.sources:
            continue
        error = find_median_error_of_sight(result, Source.TWO_VIEWS, names)
        claims.append(
            _at_most(f"two pictures show the volumes of tools {which}", "median error of mass", error, 0.05)
        )
        for holds in (1, 5):
            seen = result.scores[Source.TWO_VIEWS, holds, half]
            after = f"tools {which}, two views, {holds} hold{'s' if holds > 1 else ''}"
            claims.append(_at_most(f"masses by sight: {after}", "ALDE", seen.alde, 0.18))
            claims.append(_at_least(f"intervals of mass: {after}", "coverage", seen.coverage_mass, 0.85))
            claims.append(_at_least(f"intervals of the centre: {after}", "coverage", seen.coverage_com, 0.85))
    ours, peers = result.records["high"]["ours"], result.records["high"]["hps_stored"]
    claims += [
        _at_most("records at the highest noise: mass", "mean error", ours["mass"], 7e-3),
        _at_most("records at the highest noise: centre of mass", "mean error", ours["com"], 1.5e-3),
        _at_most("records at the highest noise: inertia", "mean error", ours["inertia"], 1e-2),
        _at_most("which is less than the authors' own", "mean error of mass", ours["mass"], peers["mass"]),
    ]
    if Half.TEST in result.config.halves:
        count = sum(outcome.made_out for outcome in result.made_out.values())
        claims.append(_at_least("materials are told apart in pictures", "of 20 tools", count, 18))
    return claims


def _describe_first_touch(result: ToolsResult) -> str:
    lost = [name for name, outcome in result.made_out.items() if not outcome.made_out]
    unsure = sum(len(outcome.unsure) for outcome in result.made_out.values())
    named = f"Not told apart: {', '.join(lost)}." if lost else "All were told apart."
    painted = sum(outcome.made_out for outcome in result.painted.values())
    return (
        f"Ten workshop tools were held, the others predicted before they were touched; {result.config.observers} "
        "observers. Everything was chosen on the learning half, where tools are judged that others can teach about; "
        f"the test half was run once. {named} In the data set's own paint it is {painted} of {len(result.painted)}. "
        f"{unsure} looks may be of more than one material, and are believed to be a mixture of them."
    )


def _describe_choices(choices: Choices, whose: str) -> str:
    found = []
    for task, words in (("hammer", "driving a nail"), ("reach", "reaching")):
        for geometry in ("drawing", "pictures"):
            after, count = count_right(choices, AFTER, task, geometry)
            one, _ = count_right(choices, ONE_DENSITY, task, geometry)
            best = choices.rankings[task, geometry, AFTER].ranked[0]
            found.append(
                f"for {words}, by {geometry}: right end of {after} of {count} tools after experience, of {one} with "
                f"one density for everything; first choice {name_object(best.tool)} by its {best.grip} "
                f"(p = {best.p_best:.2f})"
            )
    return f"Which end of {whose} hammers to hold: {'; '.join(found)}."


def _describe_uncommon(result: ToolsResult) -> str:
    motions, masses = result.uncommon.motions, result.uncommon.masses
    best = motions[0]
    weighed = "; ".join(
        f"{name_object(mass.object_name)} weighs {mass.mass:.2f} kg, looks like {mass.seen[1]:.2f} "
        f"({mass.seen[0]:.2f} to {mass.seen[2]:.2f}), and once held is believed to weigh {mass.held[1]:.2f}; "
        f"it {_say_rise(mass.rise)}"
        for mass in masses
    )
    cheapest = min(motions, key=lambda motion: motion.simulated)
    return (
        f"Two kitchen tools nobody has seen, for mashing: by two pictures and what other things weighed, the "
        f"{best.object_name} by its {best.grip} is taken (p = {best.p_best:.2f}; {best.p_best_before:.2f} before "
        f"experience), at {best.work[1]:.1f} J predicted and {best.simulated:.1f} J simulated; cheapest when "
        f"simulated is {name_object(cheapest.object_name)} by its {cheapest.grip} ({cheapest.simulated:.1f} J). In "
        f"the hand: {weighed}. What is hollow looks solid from both sides; only holding it tells."
    )


def _say_rise(rise: float) -> str:
    return f"{'rises' if rise > 0.0 else 'sinks'} by {100.0 * abs(rise):.1f} cm"
