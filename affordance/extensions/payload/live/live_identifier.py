"""Identifies the payload of a running robot, sample by sample.

Each belief is the result of ``infer`` for the rows since the last change of load, of at most a minute. Sums over
longer times are not used, because errors of the arm's model do not average out. The final answer is the result of
``identify`` for the raw rows.
"""

import bisect
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from affordance.arguments import check_array, check_kind
from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.doubts import weigh_arm
from affordance.extensions.payload.evidence.evidence import build_evidence, restore_compensated
from affordance.extensions.payload.evidence.fitted_arm import CELL
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.extensions.payload.identify import Runs, check_run, find_gains, identify
from affordance.extensions.payload.live.fixed_lag import FixedLag, join
from affordance.extensions.payload.live.load_change import WAIT, Cell, LoadChange
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.posterior.inference import infer
from affordance.extensions.payload.posterior.payload_belief import COM, PayloadBelief
from affordance.extensions.payload.recording.preparation import PreparedRun, compute_cutoff, prepare
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

_LEAST_CUTOFF = 4.0  # [Hz]; the lag is .4 s, and starts and stops of the arm pass
_FIRST = 50  # number of samples from which the stream's rate is estimated
_GAP = 0.25  # longest time step across which samples are interpolated, as in a recording, [s]
_MOST_BROKEN = 100  # successive samples with non-finite numbers after which the stream is rejected
_FARTHEST = 4.0 * np.pi  # largest joint angle, as in a recording, [rad]
_RESET = 1.0  # backward step of the time stamps that counts as a clock reset, not as a late sample, [s]
_BATCH, _EACH = 0.1, 1.0  # time between filter updates, and between beliefs, [s]
_LONGEST = 60.0  # longest part of a segment that is used, the newest, [s]
_SHORTEST = 1.5  # shortest stretch from which a belief is inferred, [s]
_STILL = 4  # number of newest cells without motion after which the arm is at rest
_NUM_SAMPLES, _FEW = 2000, 500  # samples of a belief; fewer with light loads, where annealing is slow
_LITTLE = 0.05  # lower end of the mass interval below which little or nothing may be held, [kg]
_NOTHING = 0.1  # upper end of this interval below which the hand counts as empty enough, [kg]
# A belief is precise enough if the SD of the mass, relative and [kg], and of the centre of mass, [m], are small; or
# if the SD of the mass is useful and exceeds this share of its value some time ago, [s].
_PRECISE, _PRECISE_KG, _PRECISE_M = 0.02, 0.02, 0.01
_FLAT, _FLAT_TIME, _USABLE = 0.9, 3.0, 0.2
_CHECKED = 5.0  # duration after which time stamps and unit of the stream are checked, [s]
_NAMED = 3.0  # duration after a change before disjoint intervals identify its kind, [s]
_RETRY = 5.0  # time before the full analysis is repeated if its result was not trusted, [s]
_BEHIND = 0.7  # delay of processing above which beliefs are skipped, [s]
# Usual jitter of time stamps and longest usual time step, [s]. 5 ms of jitter changed a load of .3 kg by 5 g.
_MOST_JITTER, _LONG_STEP = 0.02, 0.1
_BURSTS = 0.5  # ratio of median to mean time step below which most samples come in bursts
_NUM_STEPS = 2000  # number of newest time steps from which jitter is estimated
_UNIT_FACTOR = 4.8  # ratio of own-weight signals that no load explains, as in the doubts about a loaded run
_JUST = 20.0  # time after a final answer during which a put-down may be a payload set on the controller, [s]


@dataclass(frozen=True)
class LiveEvent:
    """Event in a stream of joint states.

    Attributes:
        kind: ready, belief, changed, taken up, put down, exchanged, disturbed, gap, at rest, controller, doubt or
            final.
        time: Time stamp of the newest sample, [s].
        content: Numbers and texts for JSON, in SI units, at the tip.
        belief: Posterior of the payload in a belief or a final answer; None otherwise.
        run: Rows that ``identify`` analysed for a final answer; None otherwise.

    Example:
        >>> from affordance import LiveEvent
        >>> LiveEvent("at rest", 2.0, {"since": 1.5}).to_dict()
        {'event': 'at rest', 'time': 2.0, 'since': 1.5}
    """

    kind: str
    time: float
    content: Mapping[str, Any]
    belief: PayloadBelief | None = field(default=None, repr=False)
    run: Run | None = field(default=None, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Converts the event to plain numbers and texts for JSON."""
        return {"event": self.kind, "time": self.time, **self.content}


class LiveIdentifier:
    """Identifies the payload of a running robot from its samples, without threads or commands.

    Attributes:
        robot: Arm up to the tip that carries the payload.
        ready: First event, with signal, joints, frame, cut-off frequency, number of empty runs, and SD of the
            apparent mass of the empty hand.

    Example:
        >>> from affordance import MODELS, LiveIdentifier, load_robot, read_run
        >>> empty, loaded = (read_run(MODELS / "demo" / f"{name}.csv") for name in ("empty", "bar_of_oak"))
        >>> live = LiveIdentifier(load_robot(MODELS / "arm.dmd.yaml"), [empty])
        >>> events = [live.add(*row) for row in zip(loaded.times, loaded.q, loaded.v, loaded.signal)]
        >>> "belief" in [event.kind for each in events for event in each]
        True
    """

    def __init__(
        self,
        robot: SerialChain,
        empty: Sequence[Run],
        *,
        gains: Gains | None = None,
        settings: IdentificationSettings = DEFAULT_SETTINGS,
    ) -> None:
        """Fits the empty arm, which takes about half a second.

        Args:
            robot: Arm from ``load_robot`` up to the tip that carries the payload.
            empty: Recordings with an empty hand and any motion; three of 15 s are much better than one.
            gains: Gains calibrated earlier with a weighed load; None for nominal gains of the signal's kind.
            settings: Settings of the final answer.

        Raises:
            BadArgumentError: An argument has the wrong type.
            BadValueError: There is no empty run, or a run does not fit the robot or is not of joint signals in
                motion.
        """
        check_kind("robot", robot, SerialChain, "load_robot(PATH, TIP) returns one")
        if not empty:
            raise BadValueError("empty", "", "is empty, must be at least one recording with an empty hand")
        runs = [check_kind(f"empty[{i}]", run, Run).arrange(robot.joint_names) for i, run in enumerate(empty)]
        first = runs[0].description
        for run in runs:
            if run.description.postures or run.description.kind is SignalKind.WRENCH:
                problem = "must be of joint signals in motion: postures and wrist sensors cannot be followed live"
                raise BadValueError(run.source, "signal", problem)
            if run.description.kind is not first.kind:
                problem = f"is {run.description.kind.value}, must be {first.kind.value} as in {runs[0].source}"
                raise BadValueError(run.source, "signal", problem)
            check_run(robot, run)
        self.robot = robot
        self._empty, self._given = tuple(runs), gains
        self._arm = robot.with_gravity(first.gravity)
        self._description = replace(first, reference_mass=None)
        self._gains = find_gains(self._arm, runs[0], runs, gains, settings)
        self._cutoff = max(_LEAST_CUTOFF, *(compute_cutoff(run, settings) for run in runs))
        # Otherwise starts and stops would raise the cut-off from answer to answer.
        self._settings = settings = replace(settings, cutoff=self._cutoff)
        parts = [prepare(run, settings, cutoff=self._cutoff) for run in runs]
        signals = [
            restore_compensated(self._arm, run, part, self._gains.mean[:, 0])
            for run, part in zip(runs, parts, strict=True)
        ]
        self._fitted = fit_empty_arm(self._arm, parts, signals, self._gains, settings)
        self._change = LoadChange(self._fitted, self._gains)
        self._own_weight = weigh_arm(self._arm, runs[0], self._gains, settings)[:, 0]
        self.num_samples, self.num_skipped, self.num_late = 0, 0, 0
        self._num_broken = 0  # number of successive samples with non-finite numbers
        self._set: PayloadSetting | None = None
        self._has_v: bool | None = None
        self._offered = -np.inf  # time of the last trusted answer, [s]
        self._forget()
        content = {
            "empty_runs": len(runs),
            "cutoff_hz": self._cutoff,
            "empty_hand_kg": self._fitted.phantom_mass,
            "signal": first.kind.value,
            "joints": list(robot.joint_names),
            "frame": robot.tip,
        }
        self.ready = LiveEvent("ready", float(runs[0].times[0]), content)

    def _forget(self) -> None:
        """Resets the state to before the first sample."""
        self._times: list[float] = []
        self._raw: list[tuple[Array, Array | None, Array]] = []
        self._steps: deque[float] = deque(maxlen=_NUM_STEPS)
        self._filter: FixedLag | None = None
        self._arrived, self._latest = -np.inf, -np.inf  # stamp of the last sample, and latest stamp, [s]
        self._newest, self._batched = -np.inf, -np.inf
        self._unnamed: float | None = None  # time of a change that is not named yet, [s]
        self._before: tuple[bool, tuple[float, float]] = (True, (0.0, _LITTLE))  # if little is held, mass interval
        self._is_still = self._is_checked = self._had_gap = False
        self._begin(-np.inf, [], [])

    def _begin(self, since: float, rows: list[PreparedRun], cells: list[Cell]) -> None:
        """Begins a segment with a constant load."""
        self._since, self._rows, self._cells = since, rows, cells
        self._pending: list[PreparedRun] = []
        self._told, self._due = -np.inf, np.inf
        self._sds: list[tuple[float, float]] = []  # times and SDs, [kg]
        self._is_done, self._tried, self._enough = False, -np.inf, ""
        self._is_light = True

    @property
    def lag(self) -> float:
        """Delay after which a sample affects the answers, [s]; 0 until the stream's rate is known."""
        return 0.0 if self._filter is None else self._filter.lag

    def add(self, t: float, q: Array, v: Array | None, signal: Array, *, behind: float = 0.0) -> list[LiveEvent]:
        """Adds a sample and returns the resulting events.

        Args:
            t: Time at which the sample was measured, not received, [s].
            q: Joint angles in the order of the robot's joints, shape (n,), [rad].
            v: Joint velocities, shape (n,), [rad/s]; None in all samples to derive them from the angles.
            signal: Signals, in the unit of the empty runs, shape (n,).
            behind: Delay with which the caller processes this sample, [s]; beliefs are skipped if it is large.

        Returns: Events, in most cases none.

        Raises:
            BadArgumentError: A shape is wrong.
            BadValueError: An angle exceeds two turns, or many successive samples contain numbers that are not finite.
                A few such samples count as lost.
        """
        n = self.robot.num_joints
        given = {"q": q, "signal": signal} if v is None else {"q": q, "v": v, "signal": signal}
        for name, values in given.items():
            row = np.array(values, dtype=float)  # a copy, because simulators reuse their memory
            check_array(name, np.zeros_like(row), (n,))
            if not np.isfinite([*row, t]).all():
                self.num_late, self._num_broken = self.num_late + 1, self._num_broken + 1
                if self._num_broken < _MOST_BROKEN:
                    return []
                joint = [*self.robot.joint_names, "its time"][int(np.argmin(np.isfinite([*row, t])))]
                problem = f"is not a finite number in {_MOST_BROKEN} samples in succession"
                raise BadValueError("the stream", f"{name} of {joint}", problem)
            given[name] = row
        if (far := np.abs(given["q"])).max() > _FARTHEST:
            joint, most = self.robot.joint_names[int(np.argmax(far))], f"{_FARTHEST:.2f} rad"
            problem = f"is {far.max():.4g} rad, must be at most {most}: are these degrees?"
            raise BadValueError("the stream", f"q of {joint}", problem)
        self._num_broken = 0
        if self._has_v is not None and self._has_v == (v is None):
            raise BadValueError("the stream", "v", "must be given for all samples or for none")
        self._has_v = v is not None
        events: list[LiveEvent] = []
        jump, has_begun = t - self._latest, np.isfinite(self._latest)
        gap = max(_GAP, 5.0 * self._filter.step if self._filter else _GAP)
        if has_begun and (jump > gap or jump < -_RESET):
            events += self._cut(t, jump)
        elif has_begun and (jump < -(self.lag or _GAP) or jump == 0.0):
            self.num_late += 1  # too late to be used, or a repeated stamp
            return events
        if np.isfinite(self._arrived):
            self._steps.append(t - self._arrived)
        self._arrived, self._latest = t, max(self._latest, t)
        self.num_samples += 1
        events += self._insert(t, (given["q"], given.get("v"), given["signal"]), behind)
        return events

    def _insert(self, t: float, sample: tuple[Array, Array | None, Array], behind: float) -> Iterator[LiveEvent]:
        """Inserts a sample in order of time, and filters the completed rows."""
        place = bisect.bisect(self._times, t) if t < self._newest else len(self._times)
        if place and self._times[place - 1] == t:
            self.num_late += 1
            return
        self._times.insert(place, t)
        self._raw.insert(place, sample)
        self._newest = max(self._newest, t)
        if self._filter is not None:
            self._filter.add(t, _build_row(sample))
        elif len(self._times) >= _FIRST:
            typical = (self._times[-1] - self._times[0]) / (len(self._times) - 1)
            self._filter = FixedLag(self._cutoff, typical, self.robot.num_joints, self._settings.max_rate)
            for time, each in zip(self._times, self._raw, strict=True):
                self._filter.add(time, _build_row(each))
        if self._filter is not None and self._newest - self._batched >= _BATCH:
            self._batched = self._newest
            yield from self._advance(behind)

    def close(self) -> list[LiveEvent]:
        """Ends the stream and returns the final answer if there was none yet."""
        if self._is_done or self._is_light or self._unnamed is not None or not self._rows:
            return []
        return list(self._finish())

    def set_payload(self, setting: PayloadSetting) -> list[LiveEvent]:
        """Records the payload that is set on the controller, expressed at the tip.

        The returned event states how the setting affects the signal.
        """
        same = self._set is not None and np.allclose(self._set.parameters, setting.parameters, atol=1e-6)
        if same:
            return []
        changed, self._set = self._set is not None, setting
        subtracts = self._description.compensates_arm
        meaning = "the signal is raw and does not depend on the setting"
        if subtracts:
            meaning = "the controller subtracts it from the signal: the rest is shown"
        content = {
            "mass_kg": setting.mass,
            "com_m": list(setting.centre_of_mass),
            "changes_signal": subtracts,
            "changed": changed,
            "why": meaning,
        }
        return [LiveEvent("controller", self._newest if self._times else self.ready.time, content)]

    def _cut(self, t: float, step: float) -> Iterator[LiveEvent]:
        """Ends the segment before a gap."""
        yield from self.close()
        before = self._before
        self._forget()
        # The load may have changed during the gap; the first beliefs after it will show a change.
        self._before, self._unnamed, self._had_gap = before, t, True
        yield LiveEvent("gap", t, {"seconds": step})

    def _advance(self, behind: float) -> Iterator[LiveEvent]:
        """Filters new rows, tests for a change every half second, and computes a belief every second."""
        assert self._filter is not None
        if (part := self._filter.take()) is None:
            return
        self._pending.append(part)
        self._rows.append(part)
        if sum(len(each.times) for each in self._pending) * self._filter.step < CELL:
            return
        whole, self._pending = join(self._pending), []
        self._cells = [*self._cells, self._build_cell(whole)][-round(_LONGEST / CELL) :]
        self._rows = [each for each in self._rows if each.times[0] > whole.times[-1] - _LONGEST]
        oldest = bisect.bisect(self._times, self._rows[0].times[0])
        if oldest > 0.1 * len(self._times):
            del self._times[:oldest], self._raw[:oldest]
        now, moved = self._newest, any(cell.moves for cell in self._cells[-_STILL:])
        if not moved and len(self._cells) >= _STILL:
            if not self._is_still:
                yield LiveEvent("at rest", now, {"why": "a load can be identified only in motion"})
            self._is_still = True
            return
        self._is_still = self._is_still and not moved
        if now >= self._due:
            self._split()
        elif self._due == np.inf and self._change.is_change(self._cells):
            self._due = now + WAIT
            if self._unnamed is None:
                yield LiveEvent("changed", now, {"why": "another load explains the newest seconds better"})
            self._unnamed = now
        elif self._due == np.inf and now - self._told >= _EACH and self._cells[-1].moves:
            if behind > _BEHIND:
                self.num_skipped += 1
                return
            self._told = now
            yield from self._believe()

    def _build_cell(self, whole: PreparedRun) -> Cell:
        signal = restore_compensated(self._arm, self._empty[0], whole, self._fitted.gain)
        evidence = build_evidence(
            self._arm,
            "the stream",
            self._description.kind,
            whole._replace(signal=signal - self._fitted.predict(whole)),
            self._settings,
            analysis="",
            is_difference=True,
        )
        return Cell.of(evidence.samples, whole.times, self._spread_jitter(whole))

    def _spread_jitter(self, whole: PreparedRun) -> Array:
        """Computes the long-run variance of the predicted signal due to time-stamp jitter, (N, n)."""
        assert self._filter is not None
        n = self.robot.num_joints
        middle = whole.select(np.full(n + 1, len(whole.times) // 2))
        predicted = self._fitted.predict(middle._replace(vdot=np.vstack([np.zeros(n), np.eye(n)])))
        inertia = predicted[1:] - predicted[0]  # signal at each joint (columns) per acceleration of each joint (rows)
        spread = self._filter.spread_jitter(whole, self._measure_jitter(), bool(self._has_v))
        variance: Array = self._filter.alike * spread**2 @ inertia**2
        return variance

    def _measure_jitter(self) -> float:
        """Estimates the SD of time stamps about an even grid, [s], robustly against outliers."""
        steps = np.array(self._steps)
        return float(np.median(np.abs(steps - np.median(steps))) / 0.6745 / np.sqrt(2.0))

    def _split(self) -> None:
        """Begins a segment after a change of load. The cell with both loads is left out."""
        age = self._change.date(self._cells)
        mixed, cells = self._cells[-age], self._cells[-age + 1 :]
        rows = [each for each in self._rows if each.times[0] >= cells[0].start]
        self._begin(cells[0].start, rows, cells)
        self._unnamed = 0.5 * (mixed.start + mixed.end)

    def _believe(self) -> Iterator[LiveEvent]:
        """Infers the payload of the segment, names a change of load, and gives a final answer if possible."""
        whole = join(self._rows)
        seconds = float(whole.times[-1] - whole.times[0])
        if seconds < _SHORTEST:
            return
        settings = replace(self._settings, num_samples=_FEW if self._is_light else _NUM_SAMPLES)
        run = replace(self._empty[0], source="the stream")
        try:
            evidence = subtract_arm(self._arm, self._fitted, run, whole, settings)
            belief = replace(infer(evidence, self._gains, settings=settings), tip=self.robot.tip)
        except (BadValueError, np.linalg.LinAlgError):  # not enough motion yet
            return
        if not self._is_checked and seconds > _CHECKED:
            self._is_checked = True
            yield from self._check()
        now, m = self._newest, belief.marginals
        low, high = belief.mass_interval90
        self._is_light = belief.is_light or low < _LITTLE
        enough, why = self._judge(belief, now)
        if enough and not self._is_light:
            self._enough = why
        elif self._enough and belief.shows_mass:
            enough, why = True, self._enough
        if self._unnamed is not None:
            yield from self._name(belief, seconds)
        if self._unnamed is None:
            self._before = (self._is_light, (low, high))
        content = {
            "of": float(whole.times[-1]),
            "seconds": seconds,
            "mass_kg": belief.mass,
            "mass_sd_kg": belief.mass_sd,
            "mass_interval90": [low, high],
            "com_m": list(m.mean[COM]),
            "com_sd_m": list(m.sd[COM]),
            "com_interval90": np.column_stack([m.low90, m.high90])[COM].tolist(),
            "holds": "little or nothing" if self._is_light else "something",
            "enough": enough,
            "why": why,
        }
        yield LiveEvent("belief", now, content, belief)
        if enough and not (self._is_done or self._is_light or self._unnamed) and now - self._tried > _RETRY:
            yield from self._finish()

    def _check(self) -> Iterator[LiveEvent]:
        """Reports faults of the stream when it begins."""
        try:
            doubts = list(self._find_doubts(self._build_run()))
        except BadValueError as error:
            doubts = [str(error)]
        for doubt in doubts:
            yield LiveEvent("doubt", self._newest, {"why": doubt})

    def _judge(self, belief: PayloadBelief, now: float) -> tuple[bool, str]:
        """Decides if the belief is precise enough, and returns the reason."""
        sd, com_sd = belief.mass_sd, float(belief.marginals.sd[COM].max())
        self._sds.append((now, sd))
        if not belief.shows_mass:
            return False, "the motion does not show the mass yet"
        high = belief.mass_interval90[1]
        if self._is_light and high < _NOTHING:
            return True, f"at most {1e3 * high:.0f} g are held"
        needed = max(_PRECISE * belief.mass, _PRECISE_KG)
        if sd <= needed and com_sd <= _PRECISE_M:
            return True, f"mass within {1e3 * needed:.0f} g and centre of mass within {1e3 * _PRECISE_M:.0f} mm (SDs)"
        earlier = [old for time, old in self._sds if time <= now - _FLAT_TIME]
        if earlier and sd > _FLAT * earlier[-1] and sd < _USABLE * max(belief.mass, 0.1):
            return True, "more of this motion hardly helps"
        if sd > needed:
            return False, f"the SD of the mass is {1e3 * sd:.0f} g, at most {1e3 * needed:.0f} g is asked for"
        return (
            False,
            f"the centre of mass is known to {1e3 * com_sd:.0f} mm, {1e3 * _PRECISE_M:.0f} mm would be enough",
        )

    def _name(self, belief: PayloadBelief, seconds: float) -> Iterator[LiveEvent]:
        """Names a change once the new load is well known, because a transient resembles any load."""
        was_light, (was_low, was_high) = self._before
        low, high = belief.mass_interval90
        apart = low > was_high or high < was_low
        sharp = belief.mass_sd < _USABLE * max(belief.mass, 0.5 * (was_low + was_high)) + _PRECISE_KG
        if not sharp and not (seconds >= _NAMED and apart):
            return
        kind = "exchanged"
        if was_light or self._is_light:
            kind = "taken up" if not self._is_light else "put down" if not was_light else "disturbed"
        since, had_gap = self._unnamed, self._had_gap
        self._unnamed, self._had_gap = None, False
        if had_gap and (kind == "disturbed" or (kind == "exchanged" and not apart)):
            return  # the load is the same as before the gap
        content: dict[str, Any] = {"since": since, "before_interval90": [was_low, was_high]}
        content |= {"mass_kg": belief.mass, "mass_interval90": [low, high]}
        if kind == "put down" and self._newest - self._offered < _JUST:
            content["why"] = "or was the payload set on the controller? From a compensated signal it is subtracted"
        yield LiveEvent(kind, self._newest, content)

    def _finish(self) -> Iterator[LiveEvent]:
        """Identifies the load from the segment's raw rows, including all reasons to doubt the result."""
        self._tried = self._newest
        content: dict[str, Any] = {}
        try:
            run = self._build_run()
            content = {"from": float(run.times[0]), "to": float(run.times[-1]), "rows": len(run.times)}
            content["cutoff_hz"] = self._cutoff
            runs = Runs(run, self._empty)
            belief = identify(self.robot, runs, paired=False, gains=self._given, settings=self._settings)
        except BadValueError as error:
            yield LiveEvent("final", self._newest, content | {"trusted": False, "doubts": [str(error)]})
            return
        belief = replace(belief, doubts=(*belief.doubts, *self._find_doubts(run)))
        self._is_done = belief.is_trusted and belief.shows_mass
        if self._is_done:
            self._offered = self._newest
        content |= belief.to_dict()
        yield LiveEvent("final", self._newest, content, belief, run)

    def _build_run(self) -> Run:
        """Builds a recording from the segment's raw rows."""
        first = bisect.bisect_left(self._times, max(self._since, float(self._rows[0].times[0])))
        q, v, signal = zip(*self._raw[first:], strict=True)
        velocities = None if v[0] is None else np.array(v)
        times = np.array(self._times[first:])
        return Run("the stream", self._description, times, np.array(q), np.array(signal), velocities)

    def _find_doubts(self, run: Run) -> Iterator[str]:
        """Finds reasons to doubt the time stamps and the unit of a stream."""
        steps, longest = np.array(self._steps), float(np.diff(run.times).max())
        jitter = self._measure_jitter()
        advice = "stamps must be the times of the samples, not of sending"
        if jitter > _MOST_JITTER:
            usual = f"at most {1e3 * _MOST_JITTER:g} ms is usual"
            yield f"the stream: stamps jitter by {1e3 * jitter:.0f} ms, {usual}: {advice}"
        if longest > _LONG_STEP:
            yield f"the stream: a step takes {longest:.2f} s, at most {_LONG_STEP:g} s is usual: {advice}"
        if np.median(steps) < _BURSTS * steps.mean():
            yield f"the stream: most samples come in bursts: {advice}"
        ratio = weigh_arm(self._arm, run, self._gains, self._settings)[:, 0] / self._own_weight
        for j in np.flatnonzero(np.abs(np.log(ratio)) > np.log(_UNIT_FACTOR)):
            yield (
                f"{self.robot.joint_names[j]}: the signal for the arm's own weight is {ratio[j]:.2g} times "
                "that of the empty run: does the stream have another unit?"
            )


def _build_row(sample: tuple[Array, Array | None, Array]) -> Array:
    """Concatenates angles, optional velocities, and signals, shape (2n,) or (3n,)."""
    return np.concatenate([values for values in sample if values is not None])
