"""Names of numbers and facts, known before anything runs, so that unknown names in a report are refused at once."""

from collections.abc import Mapping

from affordance.protocols.number_entries import OF_OBJECTS, Measure, NumberEntry

# Facts of every experiment.
FACTS = ("repeats", "seed", "camera_caption", "faults", "few_observers")
# Numbers of experience that protocols share.
EVENTS = ("samples_rejected", "trials_outlier")
# Numbers and facts of every choice, and those that a second tool adds.
OF_CHOICES = (
    *("p_correct", "p_correct_ci95", "p_correct_bayes", "p_correct_bayes_ci95", "effort_flips", "correct_grip"),
    *("energy_ratio_true", "tools", "off_axis_2mm_change", "density_true", "energy_true", "effort_true"),
    *("periods_limited", "first", "others", "materials", "num_trials", "least_effort_grip"),
)
OF_SECOND_TOOL = (
    *("p_correct_headed_tool", "p_correct_headed_tool_ci95"),
    *("correct_grip_headed_tool", "energy_true_headed_tool"),
)


def list_number_names(entries: Mapping[str, NumberEntry]) -> list[str]:
    """Lists the names of a protocol's numbers and of their intervals."""
    with_interval = [
        name
        for name, entry in entries.items()
        if entry.interval and entry.measure not in OF_OBJECTS and entry.measure is not Measure.DENSITIES
    ]
    return [*entries, *(f"{name}_ci95" for name in with_interval)]
