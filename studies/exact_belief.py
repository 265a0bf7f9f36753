"""Comparison of the library's beliefs with numerical integration: ``python -m studies.exact_belief``.

The first table compares the belief about brass. Observers hold the four rods of Simulation I at rest, and then the
decoy up to six times. The decoy looks exactly like one of the rods, so observers mistake it for this rod. The second
table compares beliefs after one hold of an object of two materials, whose densities are drawn from the prior. The
reference (``exact_reference``) has the same torques and shares no code with the library.
"""

import argparse

import numpy as np

from affordance import MODELS, load_tools
from affordance.belief.density_belief import DensityBelief, summarise_density
from affordance.belief.material_memory import MaterialMemory
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.calibration.calibration import build_config, draw_truth, get_hold
from studies.exact_reference import Hold, Model, compute_posterior

# Number of the object in each lift. Beliefs are compared after the lifts in MOMENTS.
LIFTS = (0, 1, 2, 3, *[4] * 6)
MOMENTS = {"rod 1": 1, "rod 2": 2, "rod 3": 3, "rod 4": 4, "the decoy once": 5, "the decoy six times": 10}


def main() -> None:
    """Prints median and SD of densities from program and reference, averaged over observers."""
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
    print(f"\n| one hold of two materials, {count} draws | median | 5 to 95 % |\n| --- | --- | --- |")
    differences = np.array([compare_drawn(number) for number in range(count)]).reshape(-1, 2)
    for name, column in zip(("mean", "SD"), differences.T, strict=True):
        low, median, high = np.quantile(column, [0.05, 0.5, 0.95])
        print(f"| difference of the {name} | {median:+.2%} | {low:+.2%} to {high:+.2%} |")


def compare_drawn(number: int) -> list[tuple[float, float]]:
    """Computes relative errors of mean and SD of both densities after one hold from the calibration."""
    config = build_config(DEFAULT_SETTINGS.noise, moves=False)
    noise, prior, hold = config.settings.noise, config.settings.prior, get_hold(config.settings.arm)
    colours = [part.looks_like.colour for part in config.tool.components]
    seen = measure_features(config.tool, VisionError(), np.random.default_rng(0))
    expected = predict_object(seen, MaterialMemory().add_colours(colours, prior), prior)
    felt = hold.measure(expected, draw_truth(config, number)[1], noise, (config.seed, number, 1))
    posterior, _ = condition_on_torques(expected, felt, len(hold.tau_arm), noise, prior.deviation)
    tau = felt.features[: len(hold.tau_arm)]
    exact = compute_posterior([Hold(0, tau, hold.tau_arm, hold.Y @ expected.geometry.Phi)], [[0, 1]], Model())
    believed = [summarise_density(posterior.memory.belief, i) for i in range(2)]
    return [
        (one.mean / other.mean - 1.0, one.sd / other.sd - 1.0)
        for one, other in zip(believed, exact.mu.values(), strict=True)
    ]


if __name__ == "__main__":
    main()
