"""See, guess, feel, learn: predicts the mass of brass rods before each hold, and learns from the hold.

Prints:

    rod_10cm looks like 0.07 to 0.24 kg, weighs 0.40 kg and moves -21 cm
    rod_15cm looks like 0.39 to 0.49 kg, weighs 0.60 kg and moves -3 cm
    rod_20cm looks like 0.62 to 0.70 kg, weighs 0.80 kg and moves -2 cm
"""

import itertools

from affordance import MODELS, TrialRunner, load_tools

runner = TrialRunner()
memory = runner.start_memory()
for trial, rod in enumerate(itertools.islice(load_tools(MODELS / "tools" / "weight.yaml"), 3)):
    (part,) = rod.components
    volume = rod.mass / part.material.density  # known from the visible shape, [m^3]
    guess = memory.add_colours([part.material.colour], runner.settings.prior).density("brass")
    record = runner.run_hold(rod, memory, duration=3.0, seed=(0, trial))
    memory = record.memory  # updated from the measured joint torques
    print(
        f"{rod.name} looks like {volume * guess.p25:.2f} to {volume * guess.p75:.2f} kg, weighs {rod.mass:.2f} kg "
        f"and moves {100.0 * max(record.height_centre, key=abs):+.0f} cm"
    )
