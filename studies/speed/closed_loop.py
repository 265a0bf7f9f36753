"""Cost of Python: compares the closed loop of experiment ``weight`` with a C++ controller on the same plant.

The C++ controller is Drake's InverseDynamicsController. Its torque is sampled and held with the same control period.
It has the gains of minimum angular acceleration in continuous time (6 / T^2 and 4 / T) and believes the same inertia,
so arm and integrator do the same work. Both Diagrams log the same ports. They are run alternately in one process.

Shares of the time: controller and estimator are timed in the loop. The integrator's time is that of the same plant
when C++ code alone feeds it the torques recorded in the loop, so that it moves in the same way.
"""

import dataclasses
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import MpcController
from affordance.experiments import weight
from affordance.experiments.observers import Setup
from affordance.objects.tool import Tool, list_colours
from affordance.plant.arm import Arm
from affordance.plant.load import add_arm, load_arm
from affordance.proprioception.systems import DensityEstimator
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import TrialRunner
from affordance.simulation.trial_record import TrialRecord
from studies.speed.timing import time_by_turns

NUM_TURNS = 15
# Interval at which the recorded state is restored while torques are replayed, [s].
_REPLAYED_AT_ONCE = 0.5
HEADER = [
    "object",
    "believed density",
    "C++ hold, x real time",
    "closed loop, x real time",
    "ratio",
    "integrator, %",
    "MPC, %",
    "estimator, %",
    "rest, %",
]


def build_cpp_hold(tool: Tool, density: float, settings: Settings, duration: float) -> Callable[[], None]:
    """Builds the Diagram of a hold controlled in C++; returns a function that runs one trial in a fresh Context."""
    builder = DiagramBuilder()
    arm = add_arm(builder, settings.arm)
    believed = load_arm(settings.arm)
    believed_context = believed.plant.CreateDefaultContext()
    believed.set_payload(believed_context, tool.parameters * density / tool.components[0].material.density)
    one, T = np.ones(arm.num_joints), settings.mpc.horizon
    hold = builder.AddSystem(
        InverseDynamicsController(believed.plant, 6.0 / T**2 * one, 0.0 * one, 4.0 / T * one, False, believed_context)
    )
    goal = builder.AddSystem(ConstantVectorSource(np.concatenate([arm.home, 0.0 * one])))
    builder.Connect(arm.plant.GetOutputPort("state"), hold.GetInputPort("estimated_state"))
    builder.Connect(goal.get_output_port(), hold.GetInputPort("desired_state"))
    rest = (np.zeros(1), np.concatenate([arm.home, 0.0 * one])[None])
    run = _finish_diagram(builder, arm, hold.GetOutputPort("generalized_force"), tool, settings, duration, rest)

    def run_while_believed_lives(keep_alive: object = believed) -> None:
        run()

    return run_while_believed_lives


def build_torque_replay(tool: Tool, record: TrialRecord, settings: Settings, duration: float) -> Callable[[], None]:
    """Builds the plant fed with recorded torques; returns a function that runs one trial.

    Without feedback, rounding errors grow tenfold in a twelfth of a second, so the recorded state is restored at
    intervals. The record must contain every control period.
    """
    builder = DiagramBuilder()
    arm = add_arm(builder, settings.arm)
    # A logged torque belongs to the control period that ends at its time. Each break is half a period before the
    # start of its control period, so that rounding never selects the row before.
    tau = np.vstack([record.tau[1:], record.tau[-1:]])
    steps = PiecewisePolynomial.ZeroOrderHold(
        (record.times - 0.5 * settings.control_period).tolist(), list(tau[:, :, None])
    )
    source = builder.AddSystem(TrajectorySource(steps))
    starts = np.arange(0.0, duration, _REPLAYED_AT_ONCE)
    states = np.hstack([record.q, record.v])[np.round(starts / settings.control_period).astype(int)]
    return _finish_diagram(builder, arm, source.get_output_port(), tool, settings, duration, (starts, states))


def _finish_diagram(
    builder: DiagramBuilder,
    arm: Arm,
    tau: OutputPort,
    tool: Tool,
    settings: Settings,
    duration: float,
    starts: tuple[Array, Array],
) -> Callable[[], None]:
    """Holds the torque for each control period, adds logs, and builds; ``starts`` has times and states."""
    held = builder.AddSystem(ZeroOrderHold(settings.control_period, arm.num_joints))
    builder.Connect(tau, held.get_input_port())
    builder.Connect(held.get_output_port(), arm.plant.GetInputPort("actuation"))
    for port in ("state", "net_actuation"):
        LogVectorOutput(arm.plant.GetOutputPort(port), builder, settings.log_period)
    diagram = builder.Build()

    def run() -> None:
        context = diagram.CreateDefaultContext()
        plant_context = arm.plant.GetMyMutableContextFromRoot(context)
        arm.set_payload(plant_context, tool.parameters)
        simulator = Simulator(diagram, context)
        ApplySimulatorConfig(settings.integrator.free, simulator)
        times, states = starts
        for start, end, x in zip(times, [*times[1:], duration], states, strict=True):
            context.SetTime(start)
            arm.plant.SetPositionsAndVelocities(plant_context, x)
            simulator.Initialize()
            simulator.AdvanceTo(end)

    return run


@contextmanager
def time_methods(*methods: tuple[type, str]) -> Iterator[dict[str, float]]:
    """Measures the wall time spent in methods while the context is open, by the name of their class, [s]."""
    spent: dict[str, float] = defaultdict(float)
    originals = [(owner, name, getattr(owner, name)) for owner, name in methods]

    def wrap(owner: type, original: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            start = time.perf_counter()
            result = original(*arguments)
            spent[owner.__name__] += time.perf_counter() - start
            return result

        return timed

    for owner, name, original in originals:
        setattr(owner, name, wrap(owner, original))
    try:
        yield spent
    finally:
        for owner, name, original in originals:
            setattr(owner, name, original)


def measure_case(tool: Tool, density: float) -> dict[str, float]:
    """Times the loops alternately for one object and one believed density; returns medians, [s], and shares."""
    memory = MaterialMemory.from_belief(
        list_colours([tool]), DensityBelief(np.array([[1e-4]]), np.array([1e-4 * density]))
    )
    settings, duration = DEFAULT_SETTINGS, weight.DURATION
    every_tick = dataclasses.replace(settings, log_period=settings.control_period)
    record = TrialRunner(every_tick).run_hold(tool, memory, duration=duration, seed=(0,))
    runner = TrialRunner(settings)
    runner.get_diagram(duration)
    loops: dict[str, Callable[[], object]] = {
        "cpp": build_cpp_hold(tool, density, settings, duration),
        "loop": lambda: runner.run_hold(tool, memory, duration=duration, seed=(0,)),
        "integrator": build_torque_replay(tool, record, settings, duration),
    }
    medians = time_by_turns(loops, turns=NUM_TURNS, calls_per_turn=1)

    with time_methods((MpcController, "_update"), (DensityEstimator, "_update_statistics")) as spent:
        # A system binds its callbacks when it is built, so it must be built while the methods are wrapped.
        timed = TrialRunner(settings)
        timed.run_hold(tool, memory, duration=duration, seed=(0,))
        spent.clear()
        start = time.perf_counter()
        timed.run_hold(tool, memory, duration=duration, seed=(0,))
        total = time.perf_counter() - start
    shares = {"mpc": spent["MpcController"] / total, "estimator": spent["DensityEstimator"] / total}
    return {**medians, **shares}


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Measures the trials of the experiment; returns the rows of a table, and ratios of total times."""
    tools = weight.read(Setup())
    true = tools[0].components[0].material.density
    learned = 0.97 * true  # close to the belief after one or two trials
    cases = [
        (tools[0], DEFAULT_SETTINGS.prior.mode),
        *((tool, learned) for tool in tools[1:]),
    ]
    rows = []
    totals: dict[str, float] = defaultdict(float)
    for tool, density in cases:
        found = measure_case(tool, density)
        totals["cpp"] += found["cpp"]
        totals["loop"] += found["loop"]
        integrator = found["integrator"] / found["loop"]
        rows.append(
            [
                tool.name,
                f"{density:.0f}",
                f"{weight.DURATION / found['cpp']:.1f}",
                f"{weight.DURATION / found['loop']:.1f}",
                f"{found['cpp'] / found['loop']:.2f}",
                f"{100 * integrator:.0f}",
                f"{100 * found['mpc']:.0f}",
                f"{100 * found['estimator']:.1f}",
                f"{100 * (1 - integrator - found['mpc'] - found['estimator']):.0f}",
            ]
        )
    ratios = {
        "loop_vs_cpp_hold": totals["cpp"] / totals["loop"],
        "loop_realtime_factor": len(cases) * weight.DURATION / totals["loop"],
    }
    return rows, ratios
