import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_pair, generate_run
from numpy.testing import assert_allclose
from pydrake.systems.analysis import Simulator

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.identification.identify import see_tool
from affordance.identification.posterior.inference import infer
from affordance.identification.posterior.log_cholesky import is_possible
from affordance.identification.posterior.payload_fit import build_channel_prior
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import DEFAULT_SETTINGS
from affordance.identification.systems import PayloadIdentifier, build_replay
from affordance.objects.load import load_tools

_PRIOR = Prior(1000.0, 4000.0, 0.06)
_TRUTH = Truth(friction=(0.3, 0.2, 0.1), noise_sd=0.05)


@pytest.fixture(scope="module")
def pair(robot):
    return pair_runs(robot, *generate_pair(robot, np.random.default_rng(8), _TRUTH, duration=12.0), DEFAULT_SETTINGS)


def _replay(robot, gains, evidence, placed=None):
    prior = build_channel_prior(evidence, gains, DEFAULT_SETTINGS)
    diagram, identifier = build_replay(robot, evidence, gains, prior, placed=placed)
    simulator = Simulator(diagram)
    return simulator, identifier, identifier.GetMyContextFromRoot(simulator.get_mutable_context())


def test_replayed_sums_are_those_of_the_whole_run(robot, gains, pair):
    simulator, identifier, context = _replay(robot, gains, pair)
    simulator.AdvanceTo((len(pair.prepared.times) - 1) / pair.rate)
    simulator.AdvancePendingEvents()
    online = identifier.GetOutputPort("statistics").Eval(context)
    whole = pair.compute_statistics(DEFAULT_SETTINGS)
    assert online.num_rows == whole.num_rows
    for name in ("products", "block_products", "block_sum"):
        one, other = getattr(online, name), getattr(whole, name)
        assert_allclose(one, other, rtol=1e-7, atol=1e-7 * np.abs(other).max())


def test_belief_is_the_prior_first_and_narrows_with_every_stretch(robot, gains, pair):
    simulator, identifier, context = _replay(robot, gains, pair)
    port = identifier.GetOutputPort("bodies")
    spreads = [np.log(port.Eval(context).pi[:, 0]).std()]
    assert spreads[0] == pytest.approx(1.8, rel=0.2)
    for seconds in (0.05, 1.0, 9.0):
        simulator.AdvanceTo(seconds)
        bodies = port.Eval(context)
        assert is_possible(bodies.pi).all()
        spreads.append(_spread(bodies, np.log(bodies.pi[:, 0])))
    assert spreads[3] < spreads[2] < spreads[0]
    mass = bodies.weights @ bodies.pi[:, 0]
    batch = infer(pair, gains)
    assert abs(mass - batch.mass) < 2.0 * batch.mass_sd


def test_belief_of_a_few_samples_is_possible(robot, gains, pair):
    simulator, identifier, context = _replay(robot, gains, pair)
    port = identifier.GetOutputPort("bodies")
    for sample in range(12):
        simulator.AdvanceTo(sample / pair.rate)
        simulator.AdvancePendingEvents()
        assert is_possible(port.Eval(context).pi).all()


def test_what_a_camera_saw_is_used_and_materials_learn_on_line(robot, gains, rng):
    hammer = next(tool for tool in load_tools(MODELS / "tools" / "novel.yaml") if tool.name == "hammer")
    seen = see_tool(hammer, MaterialMemory(), _PRIOR)
    runs = generate_pair(robot, rng, _TRUTH, hammer.parameters, duration=8.0)
    evidence = pair_runs(robot, *runs, DEFAULT_SETTINGS)
    simulator, identifier, context = _replay(robot, gains, evidence, seen.place(np.eye(4)))
    bodies, belief = (identifier.GetOutputPort(name) for name in ("bodies", "belief"))
    assert belief.Eval(context).parts is None
    before = bodies.Eval(context)
    assert is_possible(before.pi).all()
    simulator.AdvanceTo(4.0)
    found = belief.Eval(context).parts
    assert found.belief.memory.colours == seen.belief.memory.colours
    after = bodies.Eval(context)
    assert np.array_equal(after.pi, found.bodies.pi)
    mean = after.weights @ after.pi[:, 0]
    sd = _spread(after, after.pi[:, 0])
    assert sd < 0.5 * before.pi[:, 0].std()
    assert abs(mean - hammer.mass) < 3.0 * sd
    other = generate_run(robot, 30.0 * hammer.parameters, truth=_TRUTH, rng=rng, duration=8.0)
    other_evidence = pair_runs(robot, runs[0], other, DEFAULT_SETTINGS)
    simulator, identifier, context = _replay(robot, gains, other_evidence, seen.place(np.eye(4)))
    simulator.AdvanceTo(2.0)
    unlike = identifier.GetOutputPort("belief").Eval(context)
    assert unlike.parts is None  # another object is held
    assert unlike.bodies.weights @ unlike.bodies.pi[:, 0] > 10.0 * hammer.mass
    blind_simulator, blind_identifier, blind_context = _replay(robot, gains, evidence)
    blind_simulator.AdvanceTo(4.0)
    blind = blind_identifier.GetOutputPort("bodies").Eval(blind_context)
    # Moments of inertia, that some seconds of motion do not show.
    assert _spread(after, after.pi[:, 4]) < 0.5 * _spread(blind, blind.pi[:, 4])


def _spread(bodies, values):
    return np.sqrt(bodies.weights @ (values - bodies.weights @ values) ** 2)


def test_same_context_same_belief(robot, gains, pair):
    simulator, identifier, context = _replay(robot, gains, pair)
    simulator.AdvanceTo(2.0)
    clone = identifier.GetMyContextFromRoot(simulator.get_context().Clone())
    port = identifier.GetOutputPort("bodies")
    assert_allclose(port.Eval(context).pi, port.Eval(clone).pi, rtol=0.0, atol=0.0)


def test_a_fitted_arm_is_taken_off_live_signals(robot, gains, rng):
    """Online statistics of 30 samples, less the fitted arm's prediction, agree to 1e-6 with the offline analysis."""
    empty = generate_run(robot, None, truth=_TRUTH, rng=rng)
    loaded = generate_run(robot, PAYLOAD, truth=_TRUTH, rng=rng, motion_seed=1)
    before, after = prepare(empty, DEFAULT_SETTINGS), prepare(loaded, DEFAULT_SETTINGS)
    arm = fit_empty_arm(robot, [before], [before.signal], gains, DEFAULT_SETTINGS)
    evidence = subtract_arm(robot, arm, loaded, after, DEFAULT_SETTINGS)
    identifier = PayloadIdentifier(
        robot,
        build_channel_prior(evidence, gains, DEFAULT_SETTINGS),
        period=1.0 / after.rate,
        cutoff=after.cutoff,
        least_variance=arm.least_variance,
        fitted=arm,
    )
    context = identifier.CreateDefaultContext()
    ports = {name: identifier.GetInputPort(name) for name in ("state", "vdot", "signal")}
    for k in range(30):
        ports["state"].FixValue(context, np.concatenate([after.q[k], after.v[k]]))
        ports["vdot"].FixValue(context, after.vdot[k])
        ports["signal"].FixValue(context, after.signal[k])
        state = identifier.EvalUniquePeriodicDiscreteUpdate(context)
        context.get_mutable_discrete_state().SetFrom(state)
    online = identifier.GetOutputPort("statistics").Eval(context)
    part = evidence.select(slice(0, 30)).compute_statistics(DEFAULT_SETTINGS)
    assert_allclose(online.products, part.products, rtol=1e-6, atol=1e-6 * np.abs(part.products).max())
