"""A blow on a nail: does the integrator find the peak of the resistance, whatever the moment a step begins at?

The arm swings the novel object, held by its wooden end, at the nail with the speed that gives the demanded peak
force. The last ten milliseconds and the blow are simulated from twelve starts up to a millimetre apart, so that steps
begin at other moments, with the torques of the swing and with loggers in place. The reference is implicit
Euler at 1e-6 with steps of at most 5 us; an explicit integrator would need steps of 20 ns, as the resistance is so
stiff at rest.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import LogVectorOutput

from affordance.arm import ARM, ArmModel, attach_tool, load_arm, parse_arm
from affordance.effective_mass import EffectiveMass
from affordance.nail import Nail, NailPlacement, add_nail
from affordance.settings import DEFAULT_SETTINGS
from affordance.swing import Target, aim, plan_swing
from affordance.systems.nail_resistance import NailResistance
from affordance.tasks.hammer import load_hammer
from affordance.tools import MODELS, Tool, load_materials, load_tools
from benchmarks.tables import format_table

Array = NDArray[np.float64]

HEADER = [
    "integrator",
    "accuracy or step",
    "largest step (us)",
    "peak force (N)",
    "off the reference (%)",
    "impulse (N s)",
    "travel (mm)",
    "steps, most",
    "wall time (s)",
]
NUM_STARTS = 12
# Where the nail stands, from the striking point in the home posture, and the swing's duration (decision 0013).
OFFSET = np.array([-0.1, 0.0, -0.1])
DOWN = np.array([0.0, 0.0, -1.0])
SWING = 0.8
BEFORE, AFTER = 0.010, 0.020
CASES = (
    ("implicit_euler", 1e-3, 1e-3),
    ("implicit_euler", 1e-3, 1e-4),
    ("implicit_euler", 1e-4, 1e-4),
    ("implicit_euler", 1e-5, 2e-5),
    ("radau1", 1e-3, 1e-4),
    ("radau3", 1e-3, 1e-4),
    ("cenic", 1e-3, 1e-3),
    ("cenic", 1e-5, 1e-4),
    ("cenic", 1e-6, 1e-5),
)
# A blow that takes longer to simulate is given up, [s].
PATIENCE = 20.0
REFERENCE = ("implicit_euler", 1e-6, 5e-6)
DISCRETE_STEPS = (1e-4, 1e-5, 1e-6)


class Blow(NamedTuple):
    """What a blow did: peak and impulse of the resistance, [N], [N s], travel of the nail, [m], steps, and [s]."""

    peak: float
    impulse: float
    travel: float
    steps: int
    wall: float


def load_blow() -> tuple[Tool, Nail, Target, Array, Array]:
    """The tool, the nail, where it is struck, the state 10 ms before the strike and the torques of the swing then."""
    materials = load_materials(MODELS / "materials.yaml")
    plain = load_tools(MODELS / "tools" / "novel.yaml", materials)[0]
    tool, nail = plain.hold_by(plain.grips[0]), load_hammer(MODELS / "nail.yaml").nail
    model = ArmModel(load_arm())
    target = aim(model, tool.components, offset_W=OFFSET, direction_W=DOWN)
    swing = plan_swing(model, target, speed=1.0, duration=SWING)
    mass = EffectiveMass(model, target, swing.q_end).compute(tool.parameters[None])[0]
    speed = float(nail.compute_tip_speed(np.array(nail.force_demanded), mass))
    model.set_payload(tool.parameters)
    swing = plan_swing(model, target, speed=speed, duration=SWING)
    q, v, vdot = swing.evaluate(np.array([SWING - BEFORE]))
    x = np.concatenate([q[0], v[0]])
    model.set_state(x)
    return tool, nail, target, x, model.compute_inverse_dynamics(vdot[0])


def build_blow(
    tool: Tool, placement: NailPlacement, tau: Array, configure: Callable[[Simulator], None], time_step: float = 0.0
) -> Callable[[Array], Blow | None]:
    """Builds arm, tool and nail; returns what simulates the blow from a state, or gives None if it takes too long."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    hand = parse_arm(plant, ARM)
    attach_tool(plant, hand, tool)
    joint = add_nail(plant, placement)
    plant.set_contact_model(ContactModel.kPoint)
    plant.Finalize()
    arm = hand.body().model_instance()
    wood = builder.AddSystem(
        NailResistance(placement.nail, num_velocities=plant.num_velocities(), index=joint.velocity_start())
    )
    builder.Connect(plant.GetOutputPort("nail_state"), wood.GetInputPort("state"))
    builder.Connect(wood.GetOutputPort("force"), plant.GetInputPort("applied_generalized_force"))
    force_log = LogVectorOutput(wood.GetOutputPort("resistance"), builder)
    LogVectorOutput(plant.GetOutputPort("state"), builder, DEFAULT_SETTINGS.log_period)
    diagram = builder.Build()

    def run(x: Array) -> Blow | None:
        context = diagram.CreateDefaultContext()
        plant_context = plant.GetMyMutableContextFromRoot(context)
        plant.SetPositionsAndVelocities(plant_context, arm, x)
        plant.get_actuation_input_port().FixValue(plant_context, tau)
        simulator = Simulator(diagram, context)
        configure(simulator)
        start = time.perf_counter()

        def lose_patience(_: Context) -> EventStatus:
            if time.perf_counter() - start > PATIENCE:
                return EventStatus.ReachedTermination(diagram, "too slow")
            return EventStatus.DidNothing()

        simulator.set_monitor(lose_patience)
        simulator.AdvanceTo(BEFORE + AFTER)
        wall = time.perf_counter() - start
        if context.get_time() < BEFORE + AFTER:
            return None
        log = force_log.FindLog(context)
        force, times = np.array(log.data())[0], np.array(log.sample_times())
        travel = plant.GetPositions(plant_context)[-1]
        return Blow(force.max(), float(np.trapezoid(force, times)), float(travel), len(times), wall)

    return run


def configure_with(scheme: str, accuracy: float, max_step: float) -> Callable[[Simulator], None]:
    """Returns what sets an integrator up."""
    config = SimulatorConfig(
        integration_scheme=scheme, accuracy=accuracy, max_step_size=max_step, use_error_control=True
    )

    def configure(simulator: Simulator) -> None:
        ApplySimulatorConfig(config, simulator)

    return configure


def measure() -> list[list[str]]:
    """Simulates the blow with every setting from every start; returns rows of a table."""
    tool, nail, target, x, tau = load_blow()
    placement = NailPlacement(nail, target.p_WS, target.direction_W)
    # Up to a millimetre further along the swing: the strike comes up to 0.3 ms earlier.
    n = len(x) // 2
    starts = [
        np.concatenate([x[:n] + shift * x[n:], x[n:]]) for shift in np.linspace(0.0, 3e-4, NUM_STARTS, endpoint=False)
    ]
    exact = build_blow(tool, placement, tau, configure_with(*REFERENCE))
    reference = np.array([blow.peak for start in starts[:: NUM_STARTS // 3] if (blow := exact(start)) is not None])
    rows = [
        [
            "demanded",
            "",
            "",
            f"{nail.force_demanded:.1f}",
            "",
            "",
            f"{1e3 * (nail.depth_demanded - nail.depth_set):.2f}",
            "",
            "",
        ]
    ]
    rows.append(
        [
            REFERENCE[0],
            f"{REFERENCE[1]:.0e}",
            f"{1e6 * REFERENCE[2]:.0f}",
            _span(reference, ".1f"),
            "0",
            "",
            "",
            "",
            "",
        ]
    )
    settings = [
        (scheme, f"{accuracy:.0e}", step, configure_with(scheme, accuracy, step), 0.0)
        for scheme, accuracy, step in CASES
    ]
    settings += [("discrete", f"{1e6 * step:.0f} us", step, lambda _: None, step) for step in DISCRETE_STEPS]
    for scheme, accuracy, step, configure, time_step in settings:
        run = build_blow(tool, placement, tau, configure, time_step)
        blows = []
        for start in starts:
            blow = run(start)
            if blow is None:
                break
            blows.append(blow)
        if len(blows) < NUM_STARTS:
            rows.append([scheme, accuracy, f"{1e6 * step:.0f}", f"given up after {PATIENCE:.0f} s", *[""] * 5])
            print(rows[-1], flush=True)
            continue
        peaks = np.array([blow.peak for blow in blows])
        off = 100.0 * (peaks / reference.mean() - 1.0)
        rows.append(
            [
                scheme,
                accuracy,
                f"{1e6 * step:.0f}",
                _span(peaks, ".1f"),
                _span(off, "+.2f"),
                _span(np.array([blow.impulse for blow in blows]), ".3f"),
                _span(1e3 * np.array([blow.travel for blow in blows]), ".2f"),
                str(max(blow.steps for blow in blows)),
                _span(np.array([blow.wall for blow in blows]), ".2f"),
            ]
        )
        print(rows[-1], flush=True)
    return rows


def _span(values: Array, form: str) -> str:
    """Least and largest of some values."""
    return f"{values.min():{form}} to {values.max():{form}}"


def main() -> None:
    """Prints the table."""
    print(format_table(HEADER, measure()))


if __name__ == "__main__":
    main()
