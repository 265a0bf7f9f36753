"""Columns of tables that the program reads.

Other columns are ignored or passed on.
"""

# Of a table of lifts; ``force`` is the push, [N].
LIFT_COLUMNS = (
    *("participant", "observer", "repeat", "learner", "object", "mass", "size", "looks_like", "teaches"),
    "force",
)
# Of a table of trials; ``force``, [N], is the force that people exerted.
TRIAL_COLUMNS = (
    *("participant", "group", "phase", "cycle", "object", "do", "task", "duration", "mass", "looks_like", "teaches"),
    *("measured", "force"),
)
