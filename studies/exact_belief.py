"""Compares the belief about brass with the reference by quadrature: ``python -m studies.exact_belief``.

Observers of the library hold the four rods of Simulation I at rest, then the decoy once and six times. The decoy has
the look and size of one rod and is taken for it. The reference gets the same measured torques and shares no code with
the belief (``exact_reference``).
"""

import argparse

import numpy as np

from affordance import MODELS, load_tools
from affordance.belief.density_belief import DensityBelief
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings
from studies.exact_reference import Hold, Model, compute_posterior

# Lifts by number of the object; the belief is compared after these.
LIFTS = (0, 1, 2, 3, *[4] * 6)
MOMENTS = {"rod 1": 1, "rod 2": 2, "rod 3": 3, "rod 4": 4, "the decoy once": 5, "the decoy six times": 10}


def main() -> None:
    """Prints a table of the believed density of brass: observers' mean of median and SD, program and reference."""
    parser = argparse.ArgumentParser(description="Compares the belief about brass with a reference by quadrature.")
    parser.add_argument("--repeats", type=int, default=24, help="observers (default 24)")
    count = parser.parse_args().repeats
    tools = load_tools(MODELS / "tools" / "weight.yaml")
    lifter = StaticLifter(tools, Settings())
    seeds = [(1, observer) for observer in range(count)]
    errors = lifter.draw_errors(seeds, len(LIFTS))
    arm = StaticHold(load_arm(Settings().arm))
    torques = [arm.tau_arm + arm.Y @ tool.parameters for tool in tools]
    print(f"| after, {count} observers | median, kg/m^3 | reference | difference | SD | reference | difference |")
    print("| --- |" + " --- |" * 6)
    for name, number in MOMENTS.items():
        lifts = np.tile(np.array(LIFTS[:number])[:, None], (1, count))
        after = lifter.run(lifts, lifter.start(seeds), errors[:number], seeds).after
        believed = Settings().learner.believe(after.state)
        rows = []
        for observer in range(count):
            belief = DensityBelief.from_moments(believed.mean[observer], believed.covariance[observer])
            holds = []
            for lift, tool in enumerate(LIFTS[:number]):
                gain, offset = errors[lift, observer]
                (thing,) = lifter.identify(np.array([tool]), after.order[observer : observer + 1])
                A = (arm.Y @ lifter.gather(np.array([tool]), (0,)))[0]
                holds.append(Hold(int(thing), torques[tool] * (1.0 + gain) + offset, arm.tau_arm, A))
            found = compute_posterior(holds, [[0]] * len(tools), Model()).mu[0]
            sd = float(np.sqrt(believed.covariance[observer, 0, 0]))
            rows.append((float(belief.compute_percentiles([0.5])[0, 0]), found.median, sd, found.sd))
        median, expected, sd, expected_sd = np.mean(rows, axis=0)
        print(
            f"| {name} | {median:.0f} | {expected:.0f} | {median / expected - 1.0:+.2%}"
            f" | {sd:.0f} | {expected_sd:.0f} | {sd / expected_sd - 1.0:+.2%} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
