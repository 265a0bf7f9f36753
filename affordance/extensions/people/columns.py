"""Names of columns in tables of lifts and trials.

Other columns are ignored or copied to the results.
"""

# Columns of a table of lifts; ``force`` is the lift force before release, [N].
LIFT_COLUMNS = (
    *("participant", "observer", "repeat", "learner", "object", "mass", "size", "looks_like", "teaches"),
    "force",
)
# Columns of a table of trials; ``force`` is the measured lift force of participants, [N].
TRIAL_COLUMNS = (
    *("participant", "group", "phase", "cycle", "object", "do", "task", "duration", "mass", "looks_like", "teaches"),
    *("measured", "force"),
)
