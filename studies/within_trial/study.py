"""Narrowing of the posterior within a trial of Simulation I, and an arm that already uses it during the trial.

One observer without experience holds the first object. The paper's noise, one measurement per trial, is compared with
the engineer's, an independent error in every sample; and the paper's control, which uses the visual prior for the
whole trial, with control by the posterior as it narrows.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import NoiseModel, WhiteNoise
from affordance.settings import Settings
from affordance.simulation.trial import get_runner
from affordance.simulation.trial_record import TrialRecord
from studies.within_trial.figures import Growth, Sinking, draw_growth, draw_sinking

QUARTILES = (0.25, 0.5, 0.75)
# One hundredth of the torque limit of the strongest joint, the accuracy quoted for torque sensors of robots, [N m].
WHITE = WhiteNoise(0.7)
ONE_PERCEPT, EVERY_SAMPLE = "one percept a trial", "an error of its own in every sample"
BY_PRIOR, BY_POSTERIOR = "the visual prior, as in the paper", "the posterior as it grows"


class WithinTrial(NamedTuple):
    """Trials with one object under two noise models and two controls."""

    growth: Mapping[str, Growth]  # posterior density over time, by noise
    records: Mapping[str, TrialRecord]  # records of the trials, by the belief that control uses


class WithinTrialStudy:
    """Trials of one observer, run on first use."""

    def __init__(self, settings: Settings, tool: Tool, *, duration: float, seed: tuple[int, ...]) -> None:
        """Sets settings, an object of one material, and the duration, [s], and seed of every trial."""
        self._settings = replace(settings, posterior_log_period=settings.sample_period)
        self._tool, self._duration, self._seed = tool, duration, seed
        self.run = cache(self._run)

    def _run(self) -> WithinTrial:
        records = {
            BY_PRIOR: self._hold(self._settings),
            BY_POSTERIOR: self._hold(replace(self._settings, uses_posterior=True)),
        }
        growth = {
            ONE_PERCEPT: self._measure_growth(records[BY_PRIOR], self._settings.noise),
            EVERY_SAMPLE: self._measure_growth(self._hold(replace(self._settings, noise=WHITE)), WHITE),
        }
        return WithinTrial(growth, records)

    def summarise(self) -> dict[str, Any]:
        """Returns the numbers of metrics.json: standard deviations of the density, their theory, and heights."""
        found = self.run()
        return {
            "posterior_sd": {name: growth.sd for name, growth in found.growth.items()},
            "posterior_sd_at_rest": {name: growth.sd_at_rest for name, growth in found.growth.items()},
            "height_lowest_m": {name: record.height_centre.min() for name, record in found.records.items()},
            "height_end_m": {name: record.height_centre[-1] for name, record in found.records.items()},
        }

    def draw_growth(self) -> Figure:
        """Draws the posterior density as it narrows."""
        return draw_growth(self.run().growth, density_true=self._density, name=self._tool.name)

    def draw_sinking(self) -> Figure:
        """Draws the arm's height as it sinks and recovers."""
        return draw_sinking(
            {name: self._follow(record, name) for name, record in self.run().records.items()},
            density_true=self._density,
            name=self._tool.name,
        )

    @property
    def _density(self) -> float:
        return self._tool.components[0].material.density

    def _hold(self, settings: Settings) -> TrialRecord:
        return get_runner(settings).run_hold(self._tool, MaterialMemory(), duration=self._duration, seed=self._seed)

    def _follow(self, record: TrialRecord, believed: str) -> Sinking:
        times = np.array([entry.time for entry in record.posteriors])
        modes = np.array([entry.belief.densities.compute_mode()[0] for entry in record.posteriors])
        used = modes if believed == BY_POSTERIOR else np.full(len(modes), modes[0])
        return Sinking(record.times, record.height_centre, times, used)

    def _measure_growth(self, record: TrialRecord, noise: NoiseModel) -> Growth:
        """Measures the posterior over time of the density of the object's material, the only one known."""
        times = np.array([entry.time for entry in record.posteriors])
        densities = [entry.belief.densities for entry in record.posteriors]
        sd = np.sqrt([belief.covariance[0, 0] for belief in densities])
        quartiles = np.array([belief.compute_percentiles(QUARTILES)[:, 0] for belief in densities])
        # An entry conditions on the samples before its time; the last entry conditions on all.
        counts = np.append(np.arange(len(times) - 1) - 1, len(times) - 2).clip(0)
        return Growth(times, quartiles, sd, self._predict_sd(sd[0], noise, record.q[-1], counts))

    def _predict_sd(self, sd_before: float, noise: NoiseModel, q: Array, counts: Array) -> Array:
        """Computes the standard deviation after counts of samples by an arm at rest at q, (N,), [kg/m^3].

        With h the torques added per unit of density, a sample whose error has standard deviation s_j at joint j adds
        the precision sum_j (h_j / s_j)^2. The paper's samples add it once per trial, independent ones every time.
        """
        hold = StaticHold(load_arm(self._settings.arm), q)
        load = hold.Y @ self._tool.parameters
        h = load / self._density
        says = float(np.sum((h / noise.compute_sd(hold.tau_arm + load)) ** 2))
        independent = counts if noise is WHITE else np.minimum(counts, 1)
        sd: Array = 1.0 / np.sqrt(1.0 / sd_before**2 + independent * says)
        return sd
