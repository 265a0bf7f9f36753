"""Benchmarks of run time against other programs and brute-force solutions: ``make bench``.

All benchmarks use one process and one thread, and measure processor time. Alternatives are timed in turns, so that
the load of the machine affects them equally. Ratios are therefore more reliable than times. Each ratio is a median
over turns, followed by its range.
"""

import os
import time
from collections.abc import Callable

# This must precede the import of NumPy. Matrices are small, so threads would slow down the computation.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pinocchio
from numpy.typing import NDArray
from pydrake.solvers import MathematicalProgram, OsqpSolver, SolverOptions
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, ZeroOrderHold

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.learner import Learner
from affordance.belief.learners import LEARNERS
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import plan_strike
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import Costs
from affordance.choice.picking import pick_cheapest
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.problem import TerminalGoal, compute_responses
from affordance.control.strike import Strike
from affordance.control.task import Hold
from affordance.experiments import hammer, reach, weight
from affordance.experiments.shared import experience
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.objects.tool import Tool, list_colours, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import add_arm, load_arm
from affordance.reporting.formatting import tabulate
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.rollout import roll_out
from affordance.simulation.trial import TrialRunner

SETTINGS = DEFAULT_SETTINGS
_TURNS = 9  # number of turns for holds and for choices of a grip
# Row of the table: benchmark, alternative, and result.
type Row = list[str]


def time_in_turns(*calls: Callable[[], object], turns: int, calls_per_turn: int = 1) -> Array:
    """Measures the processor time of functions in turns, after one call of each.

    Returns: Mean time per call of each function in each turn, [s], (functions, turns).
    """
    for call in calls:
        call()
    times = np.empty((len(calls), turns))
    for turn in range(turns):
        for place, call in enumerate(calls):
            start = time.process_time()
            for _ in range(calls_per_turn):
                call()
            times[place, turn] = (time.process_time() - start) / calls_per_turn
    return times


def format_turns(ratios: Array, decimals: int) -> str:
    """Formats the median over turns with the range."""
    middle, low, high = (f"{f(ratios):,.{decimals}f}" for f in (np.median, np.min, np.max))
    return f"{middle} ({low} to {high})"


def build_cpp_hold(tool: Tool, density: float) -> Callable[[], object]:
    """Returns a function that simulates a hold with a C++ controller of Drake, using the same gains and belief."""
    builder, T = DiagramBuilder(), SETTINGS.mpc.horizon
    arm, believed = add_arm(builder, SETTINGS.arm), load_arm(SETTINGS.arm)
    context = believed.plant.CreateDefaultContext()
    believed.set_payload(context, tool.parameters * density / tool.components[0].material.density)
    one = np.ones(arm.num_joints)
    gains = 6.0 / T**2 * one, 0.0 * one, 4.0 / T * one  # for minimum angular acceleration in continuous time
    control = builder.AddSystem(InverseDynamicsController(believed.plant, *gains, False, context))
    rest = np.concatenate([arm.home, 0.0 * one])
    goal = builder.AddSystem(ConstantVectorSource(rest))
    held = builder.AddSystem(ZeroOrderHold(SETTINGS.control_period, arm.num_joints))
    builder.Connect(arm.plant.GetOutputPort("state"), control.GetInputPort("estimated_state"))
    builder.Connect(goal.get_output_port(), control.GetInputPort("desired_state"))
    builder.Connect(control.GetOutputPort("generalized_force"), held.get_input_port())
    builder.Connect(held.get_output_port(), arm.plant.GetInputPort("actuation"))
    for port in ("state", "net_actuation"):
        LogVectorOutput(arm.plant.GetOutputPort(port), builder, SETTINGS.log_period)
    diagram = builder.Build()

    def run(keep_alive: object = believed) -> None:
        root = diagram.CreateDefaultContext()
        own = arm.plant.GetMyMutableContextFromRoot(root)
        arm.set_payload(own, tool.parameters)
        arm.plant.SetPositionsAndVelocities(own, rest)
        simulator = Simulator(diagram, root)
        ApplySimulatorConfig(SETTINGS.integrator.free, simulator)
        simulator.Initialize()
        simulator.AdvanceTo(weight.DURATION)

    return run


def measure_loop() -> list[Row]:
    """Compares the control loop with a controller in C++ in the trials of Simulation I."""
    tools, runner = weight.read(Setup()), TrialRunner(SETTINGS)
    learned = 0.97 * tools[0].components[0].material.density  # close to the belief after one or two trials
    times = np.zeros((2, _TURNS))
    for number, tool in enumerate(tools):
        density = learned if number else SETTINGS.prior.mode
        belief = DensityBelief(np.array([[1e-4]]), np.array([1e-4 * density]))
        memory = MaterialMemory.from_belief(list_colours([tool]), belief)

        def hold(tool: Tool = tool, memory: MaterialMemory = memory) -> None:
            runner.run_hold(tool, memory, duration=weight.DURATION, seed=(0,))

        times += time_in_turns(build_cpp_hold(tool, density), hold, turns=_TURNS)
    hertz = f"{1.0 / SETTINGS.control_period:.0f} Hz"
    in_cpp, ours = times
    speed = format_turns(len(tools) * weight.DURATION / ours, 0)
    return [
        [f"closed loop at {hertz}", "the same plant, held in C++", f"{format_turns(in_cpp / ours, 2)} of its speed"],
        [f"closed loop at {hertz}", "real time", f"{speed} times as fast"],
    ]


def measure_mpc() -> list[Row]:
    """Compares a control period with pure linear algebra and, at active limits, with OSQP."""
    arm, rng = load_arm(), np.random.default_rng(0)
    model, hold, mpc, n = (
        ArmModel(arm),
        Hold(arm.home),
        MinimumAccelerationMpc(arm.limits, SETTINGS.mpc),
        arm.num_joints,
    )
    angle, rate = (np.kron(response, np.eye(n)) for response in compute_responses(SETTINGS.mpc))
    G, T = np.vstack([angle[-n:], rate[-n:]]), SETTINGS.mpc.horizon
    states = [np.concatenate([arm.home + 0.01 * rng.normal(size=n), 0.02 * rng.normal(size=n)]) for _ in range(100)]
    goal, gram = hold.compute_goal(model, states[0], 0.0, 0.24), G @ G.T

    def find_missing(x: Array, goal: TerminalGoal) -> Array:
        return np.concatenate([goal.d_q - x[:n] - T * x[n:], goal.d_v - x[n:]])

    def solve_algebra() -> None:
        for x in states:
            G.T @ np.linalg.solve(gram, find_missing(x, goal))

    def control(states: list[Array]) -> None:
        for x in states:
            model.set_state(x)
            mpc.solve(x, hold.compute_goal(model, x, 0.0, 0.24), model)

    def build_program(x: Array, goal: TerminalGoal) -> MathematicalProgram:
        """Builds a quadratic program that suits OSQP: only accelerations, with hard goal and limits.

        The program can be infeasible.
        """
        program, limits, steps = MathematicalProgram(), arm.limits, len(angle) // n
        vdot = program.NewContinuousVariables(len(angle))
        program.AddQuadraticCost(2.0 / steps * np.eye(len(angle)), np.zeros(len(angle)), vdot, is_convex=True)
        drift = x[:n] + np.arange(1, steps + 1)[:, None] * T / steps * x[n:]
        low, high = np.tile(-limits.v_max - x[n:], steps), np.tile(limits.v_max - x[n:], steps)
        motion: Array = np.vstack([angle, rate])
        low, high = (
            np.concatenate([(q - drift).ravel(), v]) for q, v in ((limits.q_lower, low), (limits.q_upper, high))
        )
        program.AddLinearConstraint(motion, low, high, vdot)
        program.AddLinearEqualityConstraint(G, find_missing(x, goal), vdot)
        bias, M = model.compute_inverse_dynamics(np.zeros(n)), model.compute_mass_matrix()
        program.AddLinearConstraint(M, -limits.tau_max - bias, limits.tau_max - bias, vdot[:n])
        return program

    options = SolverOptions()
    for name, value in (("eps_abs", 1e-6), ("eps_rel", 1e-6), ("max_iter", 20_000)):
        options.SetOption(OsqpSolver.id(), name, value)
    limited: list[Array] = []
    programs: list[MathematicalProgram] = []
    while len(limited) < 40:
        x = np.concatenate([arm.home + 0.2 * rng.normal(size=n), 1.5 * rng.normal(size=n)])
        model.set_state(x)
        at = hold.compute_goal(model, x, 0.0, 0.24)
        if mpc.solve(x, at, model).status is MpcStatus.LIMITED:
            program = build_program(x, at)
            if OsqpSolver().Solve(program, None, options).is_success():
                limited.append(x)
                programs.append(program)

    def solve_osqp() -> None:
        for program in programs:
            OsqpSolver().Solve(program, None, options)

    algebra, free = time_in_turns(solve_algebra, lambda: control(states), turns=21, calls_per_turn=5)
    ours, osqp = time_in_turns(lambda: control(limited), solve_osqp, turns=7)
    return [
        [
            "control step, no limit active",
            "closed form, factorised at every step",
            f"{format_turns(free / algebra, 1)} times its time",
        ],
        [
            "control step, limits active",
            "OSQP at 1e-6, on stored programs",
            f"{format_turns(ours / osqp, 2)} of its time",
        ],
    ]


def measure_regressor() -> list[Row]:
    """Compares the payload regressor of 300 samples with the full regressor of Pinocchio.

    Pinocchio's regressor of one body takes three calls from Python and is slower.
    """
    chain, other = build_chain(load_arm()), pinocchio.Model()
    for number in range(chain.num_joints):
        joint = pinocchio.JointModelRevoluteUnaligned(chain.axes[number])
        place = pinocchio.SE3(chain.R_PF[number], chain.p_PF[number])
        other.addJoint(number, joint, place, chain.joint_names[number])
    data = other.createData()
    q, v, vdot = np.random.default_rng(0).normal(size=(3, 300, chain.num_joints))

    def loop() -> None:
        for row in zip(q, v, vdot, strict=True):
            pinocchio.computeJointTorqueRegressor(other, data, *row)

    ours, theirs = time_in_turns(
        lambda: chain.compute_payload_regressors(q, v, vdot), loop, turns=21, calls_per_turn=5
    )
    ratio = f"{format_turns(ours / theirs, 2)} of its time"
    return [["payload regressor, 300 samples", "Pinocchio's, C++, in a loop", ratio]]


def measure_strike() -> list[Row]:
    """Measures the time for simulating a blow with contact for both grips of the stick."""
    _, (stick, *_), task = hammer.read(Setup())
    memory = MaterialMemory.from_densities(list_densities([stick]))
    model, runner, seconds, contact = ArmModel(load_arm()), TrialRunner(SETTINGS), [], 0.0
    for tool in stick.list_gripped().values():
        costs = task.build_cost(model, tool.components, SETTINGS)
        planned = plan_strike(costs, task, model, tool.parameters, SETTINGS)
        strike = Strike(planned.swing, planned.placement, SETTINGS.control_period)
        trial = runner.get_diagram(tool, planned.placement)
        simulator = trial.prepare(trial.diagram.CreateDefaultContext(), tool, strike, memory, (0,))
        touch, leave = strike.contact
        contact = leave - touch
        simulator.AdvanceTo(touch)
        config = SETTINGS.integrator.contact
        config.start_time = touch
        for _ in range(5):
            own = Simulator(trial.diagram, simulator.get_context().Clone())
            ApplySimulatorConfig(config, own)
            start = time.process_time()
            own.AdvanceTo(leave)
            seconds.append(time.process_time() - start)
    return [[f"{1e3 * contact:.0f} ms of a blow in contact", "", f"{format_turns(np.array(seconds), 2)} s"]]


def measure_decisions() -> list[Row]:
    """Compares inner simulation with full simulation for choosing a grip of the stick for reaching.

    Half of the densities are drawn from the prior, and half after the first hold, so that there are near ties.
    """
    setup, count, many = Setup(), 100, 10_000
    held, (tool, *_), task = reach.read(setup)
    start = time.process_time()
    choice = plan_choice(list_options(tool), task, setup.settings)  # once: the plan is then in a cache
    planning = time.process_time() - start
    _, (before, after, *_), _ = experience.hold(setup, held, 0)
    rng = np.random.default_rng(0)
    beliefs = [memory.belief.add_object_variation(setup.settings.prior.deviation) for memory in (before, after)]
    rho = np.vstack([belief.draw_samples(rng, count // 2) for belief in beliefs])
    work, feasible = np.empty((2, count)), np.empty((2, count), dtype=bool)

    def simulate(samples: NDArray[np.int_]) -> None:
        for k in samples:
            known = dict(zip(list_colours(held), map(float, rho[k]), strict=True))
            for place, own in enumerate(tool.list_gripped().values()):
                motion = roll_out(own, task, known, setup.settings)
                work[place, k], feasible[place, k] = motion.work, motion.error <= task.path.tolerance

    def decide() -> None:
        pick_cheapest(choice.compute_costs(choice.draw_parameters(before, rng, many)), rng)

    decide()
    of_one, of_many = np.empty((2, _TURNS))
    for turn, samples in enumerate(np.array_split(np.arange(count), _TURNS)):
        start = time.process_time()
        simulate(samples)
        middle = time.process_time()
        decide()
        of_one[turn], of_many[turn] = (middle - start) / len(samples), time.process_time() - middle
    planned = choice.compute_costs(choice.compute_parameters(before, rho))
    full = Costs(work, np.full_like(work, np.nan), feasible, work)
    one, other = (pick_cheapest(costs, np.random.default_rng(0)) for costs in (planned, full))
    ratio = format_turns(many * of_one / (of_many + planning), 0)
    same = f"same choice in {np.sum(one == other)} of {count}"
    return [[f"{many:,} choices of a grip, with planning", "simulating both grips", f"{ratio} times as fast; {same}"]]


def measure_observers() -> list[Row]:
    """Compares simulating 1,000 observers of Linear++ together with simulating them one by one."""
    return [_time_lifts(learner) for learner in LEARNERS.values()]


def _time_lifts(learner: Learner) -> Row:
    setup, count = Setup().change(learner=learner), 1000
    tools = linear.make_objects("linear_plus_plus")
    lifter = StaticLifter(tools, setup.settings)
    order = np.array([*range(len(tools) - 1)] * 4 + [len(tools) - 1] * 2)
    errors = lifter.draw_errors([(0, number) for number in range(count)], len(order))

    def lift(observers: range) -> None:
        own = [(0, number) for number in observers]
        objects = np.repeat(order[:, None], len(own), axis=1)
        lifter.run(objects, lifter.start(own), errors[:, observers.start : observers.stop], own)

    def lift_ten() -> None:
        for number in range(10):
            lift(range(number, number + 1))

    at_once, ten = time_in_turns(lambda: lift(range(count)), lift_ten, turns=5)
    ratio = f"{format_turns(0.1 * count * ten / at_once, 0)} times as fast"
    return [f"lifts of {count:,} observers as arrays, {learner.name}", "the same one by one", ratio]


def main() -> None:
    """Runs all benchmarks, and prints a table."""
    rows = [["what is measured", "compared with", "result"], *measure_loop(), *measure_mpc(), *measure_regressor()]
    print("\n".join(tabulate([*rows, *measure_strike(), *measure_decisions(), *measure_observers()])))


if __name__ == "__main__":
    main()
