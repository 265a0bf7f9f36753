"""Fits: scores one step ahead and left out by hand, groups of the tree, and the commands."""

import json
import os
import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from helpers.answers import answer
from helpers.refusals import refuse, refuse_command
from scipy.special import logsumexp

from affordance.belief.learners import DENSITY, KINDS_DRAWN
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people import fit
from affordance.extensions.people.comparison_figures import draw_pushes
from affordance.extensions.people.experiments.lifts import cylinder, repeat, run_lifts
from affordance.extensions.people.fit import (
    MOST_NOISE,
    Question,
    arrange_for_loo,
    compare,
    describe_fit,
    find_best,
    fit_each,
    fit_pooled,
    leave_out,
    read_fit,
    score_ahead,
    warn_of_noise,
)
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import LiftSettings, Participant
from affordance.extensions.people.pushes import read_lifts
from affordance.extensions.people.rivals import OWN_MEMORY
from affordance.runs.repeats import end_processes

TOOLS = (
    cylinder("small", radius=0.045, height=0.06, mass=0.6),
    cylinder("large", radius=0.045, height=0.12, mass=1.2),
    cylinder("odd", radius=0.045, height=0.09, mass=1.9),
)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Lifts of two simulated people with own memory, as lifts.csv."""
    folder = tmp_path_factory.mktemp("people")
    setup = Setup(observers=2, seed=3, out=folder, settings=LiftSettings(participant=Participant(push_error=0.2)))
    lifts = run_lifts(
        "mine", setup, TOOLS, lambda observer, rng: repeat(["small", "large", "odd"], 8, rng, block="x"), [OWN_MEMORY]
    )
    lifts.to_csv(folder / "lifts.csv", index=False)
    return folder / "lifts.csv"


average = Question.average_streams


def ask(table, learner, draws=8, particles=6, free=None, **settings):
    settings = LiftSettings(**settings)
    return Question(
        read_lifts(table), learner, settings, list_free(learner, settings.participant, free), draws, particles
    )


def test_scores_one_step_ahead_add_up_to_the_evidence():
    parts = np.random.default_rng(0).normal(size=(5, 7))
    assert score_ahead(parts).sum() == pytest.approx(logsumexp(parts.sum(axis=1)) - np.log(5))
    assert score_ahead(parts)[0] == pytest.approx(logsumexp(parts[:, 0]) - np.log(5))
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(score_ahead(parts), logsumexp(parts, axis=0) - np.log(5))


def test_a_participant_is_left_out_by_the_posterior_of_the_others():
    """With equal prior draws, drawn by the posterior of all, weights by 1 / likelihood give that of the others."""
    rng = np.random.default_rng(1)
    parts = rng.normal(size=(4, 3, 2))  # values, participants, pushes
    totals = parts.sum(axis=2)
    posterior = np.exp(totals.sum(axis=1) - logsumexp(totals.sum(axis=1)))
    draws = rng.choice(4, size=200_000, p=posterior)
    scores, effective = leave_out(parts[draws])
    for place in range(3):
        others = totals.sum(axis=1) - totals[:, place]
        np.testing.assert_allclose(scores[place], score_ahead(parts[:, place], others), atol=0.02)
    assert (effective > 1000.0).all()


def test_groups_and_dimensions_are_those_of_arviz(table):
    question = ask(table, OWN_MEMORY)
    each = describe_fit(question, [one.draws for one in fit_each(question)])
    pooled = describe_fit(question, fit_pooled(question))
    assert {*each.children} == {"posterior", "prior", "log_likelihood", "observed_data", "sample_stats"}
    assert each["posterior"]["push_error"].dims == ("chain", "draw", "participant")
    assert pooled["posterior"]["push_error"].dims == ("chain", "draw")
    for tree in (each, pooled):
        assert isinstance(tree, xr.DataTree)
        assert tree["log_likelihood"]["push"].dims == ("chain", "draw", "participant", "trial")
        assert tree["log_likelihood"]["push"].shape == (1, 8, 2, 24)
        assert tree["observed_data"]["push"].dims == ("participant", "trial")
    lifts = pd.read_csv(table)
    np.testing.assert_allclose(each["observed_data"]["push"].values.ravel(), lifts["force"])
    assert 0.1 < float(pooled["posterior"]["push_error"].mean()) < 0.4


@pytest.fixture(scope="module")
def ragged(table):
    """Fits with two chains, pooled and each, of people one of whom has fewer lifts."""
    lifts = pd.read_csv(table)
    lifts.iloc[:-5].to_csv(table.with_name("ragged.csv"), index=False)
    question = replace(ask(table.with_name("ragged.csv"), OWN_MEMORY, draws=16), chains=2)
    pooled = fit_pooled(question)
    each = [one.draws for one in fit_each(question)]
    return question, pooled, describe_fit(question, pooled), describe_fit(question, each)


def test_chains_are_independent_samplers(ragged, table):
    question, pooled, tree, each = ragged
    assert tree["posterior"]["push_error"].shape == (2, 16)
    assert each["log_likelihood"]["push"].shape == (2, 16, 2, 24)
    first = fit_pooled(replace(question, chains=1))
    np.testing.assert_array_equal(tree["posterior"]["push_error"][0], question.convert(first.normal)[:, 0])
    assert not np.isin(tree["posterior"]["push_error"][1], tree["posterior"]["push_error"][0]).any()
    assert tree["prior"]["push_error"].shape == (2, 16)
    np.testing.assert_allclose(
        tree["log_likelihood"]["push"].sum("trial").values.reshape(32, 2), pooled.log_likelihoods.sum(axis=2)
    )


def test_what_arviz_leaves_out_has_no_missing_values(ragged):
    tree = ragged[2]
    assert int(tree["log_likelihood"]["push"].isnull().sum()) == 32 * 5
    people = arrange_for_loo(tree)["log_likelihood"]["push"]
    assert people.dims == ("chain", "draw", "participant")
    pushes = arrange_for_loo(tree, "push")["log_likelihood"]["push"]
    assert pushes.dims == ("chain", "draw", "number")
    assert pushes.shape == (2, 16, 2 * 24 - 5)
    assert np.isfinite(people).all()
    assert np.isfinite(pushes).all()
    np.testing.assert_allclose(people.sum("participant"), pushes.sum("number"))
    assert "by: is 'lift', must be one of participant, push" in refuse(arrange_for_loo, tree, "lift")


def test_arviz_reads_a_fit(ragged):
    """Where ArviZ 1 is installed (extra people): its summary, and participants left out as leave_out does it."""
    arviz = pytest.importorskip("arviz", minversion="1.0")
    _, pooled, tree, each = ragged
    assert arviz.summary(each, var_names=["push_error"]).shape[0] == 2
    assert np.isfinite(float(arviz.summary(tree, round_to="none")["r_hat"].iloc[0]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # few draws
        loo = arviz.loo(arrange_for_loo(tree), pointwise=True)
        table = arviz.compare({"a": arrange_for_loo(tree, "push"), "b": arrange_for_loo(each, "push")})
    np.testing.assert_allclose(loo.elpd_i, leave_out(pooled.log_likelihoods)[0].sum(axis=1), atol=0.5)
    assert len(table) == 2


def test_the_learner_of_simulated_people_predicts_them_best(table):
    found = compare([ask(table, learner) for learner in (DENSITY, OWN_MEMORY)])
    assert found.find_best() == found.find_best("bic") == ["own_memory"] * 2
    shown = found.tabulate()
    assert shown["behind_best"].max() == shown["above_best"].min() == 0.0
    assert (shown.loc[shown["learner"] == "density", "behind_best"] < -2.0).all()


def test_noise_of_particles_is_that_over_seeds_and_falls_with_their_number(table):
    normal, noise = np.zeros((2, 1)), {}
    for particles in (3, 100):
        question = ask(
            table, KINDS_DRAWN, particles=particles, free=["kappa"], participant=Participant(push_error=0.2)
        )
        noise[particles] = question.estimate_noise(normal)
        seeds = [question.compute(0, normal[:1], [k]).sum() for k in range(1, 7)]
        assert noise[particles][0] == pytest.approx(np.std(seeds, ddof=1))
        assert question.compute(0, normal[:1], [1]).sum() != question.compute(0, normal[:1]).sum()
    assert (noise[100] < 0.5 * noise[3]).all()


def test_a_score_is_of_the_mean_likelihood_over_streams(table, monkeypatch):
    """The likelihoods of six streams are 2 to 64 times that of the fit's; a mean of logarithms would be .8 less."""
    question, used = ask(table, KINDS_DRAWN, free=["push_error", "kappa"]), []
    whole = fit._fit_one(question, 0).draws.log_evidence

    def filter_known(self, place, normal, repeats=()):
        used.append((normal, repeats or [0] * len(normal)))
        logs = np.column_stack([normal[:, 0], [number * np.log(2.0) for number in used[-1][1]]])
        return fit.Filtered(logs, logs)

    draws = np.random.default_rng(0).normal(size=(12, 2))
    monkeypatch.setattr(Question, "filter", filter_known)
    mean = np.log((1 + 2 + 4 + 8 + 16 + 32 + 64) / 7)
    assert question.average_streams(0, draws) == pytest.approx(mean)
    (others, streams), (own, zeros) = used
    assert (list(streams), list(zeros)) == ([1, 2, 3, 4, 5, 6], [0] * 6)
    np.testing.assert_array_equal(others, own)
    np.testing.assert_array_equal(others[:, 0], draws[::2, 0])
    np.testing.assert_allclose(others[:, 1], draws[::2, 1], atol=0.25)
    monkeypatch.undo()
    monkeypatch.setattr(Question, "average_streams", lambda self, place, normal: 0.0)
    alone = fit._fit_one(question, 0).draws
    assert whole - alone.log_evidence == pytest.approx(average(question, 0, alone.normal))


def test_noise_is_warned_of_where_a_fit_cannot_be_relied_on():
    (line,) = warn_of_noise(["P1", "P2"], np.array([MOST_NOISE, 3.44]))
    assert line.startswith("warning: P2: not to be relied on")
    assert "SD of 3.4, must be at most 1, and a log score is up to 5.9 too low: use more --particles" in line


def test_noise_is_estimated_at_the_most_probable_draw(table):
    question = ask(table, OWN_MEMORY)
    found = fit_each(question)
    best = [each.draws.normal[each.draws.log_likelihoods.sum(axis=1).argmax()] for each in found]
    np.testing.assert_allclose([each.noise for each in found], question.estimate_noise(np.array(best)))
    pooled = fit_pooled(question)
    best = find_best(question, pooled)
    assert (best == pooled.normal[pooled.log_likelihoods.sum(axis=(1, 2)).argmax()]).all()


def test_who_is_noisy_is_fitted_again_with_more_particles(table, monkeypatch):
    question = ask(table, KINDS_DRAWN, draws=4, particles=2, free=["kappa"], participant=Participant(push_error=0.1))
    monkeypatch.setattr("affordance.extensions.people.fit.MOST_NOISE", 0.0)
    monkeypatch.setattr("affordance.extensions.people.fit._MOST_PARTICLES", 10)
    assert [each.particles for each in fit_each(question)] == [10, 10]
    monkeypatch.setattr("affordance.extensions.people.fit.MOST_NOISE", 1e9)
    assert [each.particles for each in fit_each(question)] == [2, 2]
    monkeypatch.setattr("affordance.extensions.people.fit.MOST_NOISE", 0.0)
    monkeypatch.setattr("affordance.extensions.people.fit._MOST_NUMBERS", 9 * 4 * 2)
    assert replace(question).most_rows == 8
    assert [each.particles for each in fit_each(replace(question))] == [2, 2]


def test_objects_that_differ_in_mass_alone_limit_no_number_of_draws(tmp_path):
    masses = np.linspace(0.3, 0.9, 3000)
    rows = pd.DataFrame({"object": "can", "mass": masses, "size": 5e-4, "force": 9.81 * masses})
    rows.to_csv(tmp_path / "masses.csv", index=False)
    question = ask(tmp_path / "masses.csv", OWN_MEMORY)
    assert (len(question.lifts.tools), question.most_rows) == (3000, 200_000_000 // 3000)
    rows = rows[::2].assign(looks_like=np.repeat(["red", "blue"], 750))
    rows.to_csv(tmp_path / "looks.csv", index=False)
    assert ask(tmp_path / "looks.csv", OWN_MEMORY).most_rows == 100_000
    sizes, colours = np.divmod(np.arange(1500), 50)
    rows = rows.assign(size=1e-4 * 1.12**sizes, looks_like=[f"#{60000 * k:06x}" for k in colours])
    rows.to_csv(tmp_path / "looks.csv", index=False)
    assert "--draws: is 8, must be at most 7" in refuse(ask, tmp_path / "looks.csv", OWN_MEMORY)


def test_people_who_were_fitted_before_a_fit_was_killed_are_taken_up(table, tmp_path, monkeypatch):
    """A fit that ends after two of three people is started again: it fits the third, and another question all."""
    lifts = pd.read_csv(table)
    third = lifts[lifts["observer"] == 0].assign(observer=2, force=lambda rows: 1.1 * rows["force"])
    pd.concat([lifts, third.iloc[:-3]]).to_csv(tmp_path / "three.csv", index=False)
    question, fitted = ask(tmp_path / "three.csv", OWN_MEMORY), []

    def fit_two(question, place):
        fitted.append(place)
        if len(fitted) == 3:
            raise KeyboardInterrupt
        return fit_one(question, place)

    fit_one = fit._fit_one
    whole = fit_each(question)
    monkeypatch.setattr(fit, "_fit_one", fit_two)
    with pytest.raises(KeyboardInterrupt):
        fit_each(question, tmp_path / "kept")
    found = fit_each(replace(question, jobs=1), tmp_path / "kept")
    assert fitted == [0, 1, 2, 2]
    for one, other in zip(found, whole, strict=True):
        assert one[1:3] == other[1:3]
        np.testing.assert_array_equal(one.predicted, other.predicted)
        assert one.draws.log_evidence == other.draws.log_evidence
        np.testing.assert_array_equal(one.draws.normal, other.draws.normal)
        np.testing.assert_array_equal(one.draws.log_likelihoods, other.draws.log_likelihoods)
    assert describe_fit(question, [each.draws for each in found]).equals(
        describe_fit(question, [each.draws for each in whole])
    )
    fit_each(replace(question, seed=1), tmp_path / "kept")
    assert fitted[4:] == [0, 1, 2]
    lifts["force"] = lifts["force"].round(3)
    lifts.to_csv(tmp_path / "rounded.csv", index=False)
    fit_each(ask(tmp_path / "rounded.csv", OWN_MEMORY), tmp_path / "kept")
    assert fitted[7:] == [0, 1]


def test_courses_that_were_drawn_before_a_pooled_fit_was_killed_are_taken_up(table, tmp_path, monkeypatch):
    question, drawn = ask(table, KINDS_DRAWN, draws=4, particles=3), []
    whole, draw = fit_pooled(question), fit.draw_courses

    def draw_one(person, *arguments, **options):
        if len(drawn) == 1:
            drawn.append("killed")
            raise KeyboardInterrupt
        drawn.append(person.name)
        return draw(person, *arguments, **options)

    monkeypatch.setattr(fit, "draw_courses", draw_one)
    with pytest.raises(KeyboardInterrupt):
        fit_pooled(question, tmp_path / "kept")
    found = fit_pooled(replace(question), tmp_path / "kept")
    assert drawn[:3] == ["0", "killed", "1"]
    np.testing.assert_array_equal(found.normal, whole.normal)
    np.testing.assert_array_equal(found.log_likelihoods, whole.log_likelihoods)


def test_log_likelihoods_between_nodes_are_close_to_those_computed_there(table, monkeypatch):
    """With nodes at once and half the distance, sums of log likelihoods differ by less than the particles' noise."""
    question = ask(table, KINDS_DRAWN, particles=200, free=["kappa"], participant=Participant(push_error=0.2))
    normal = np.array([[0.25], [-0.75]])
    between = question.compute(0, normal).sum(axis=1)
    monkeypatch.setattr("affordance.extensions.people.fit._STEP", 0.25)
    exact = replace(question).compute(0, normal).sum(axis=1)
    assert (between != exact).all()
    np.testing.assert_allclose(between, exact, atol=0.5)


def test_fit_and_comparison_as_commands(table, tmp_path):
    words = (table, "--draws", 4, "--particles", 3, "--jobs", 1, "--out", tmp_path)
    said = answer("fit", *words, "--learner", "own_memory").out
    assert said.startswith("0: pushes 24, log_score -")
    assert "push_error 0." in said
    tree = read_fit(tmp_path / "fit_lifts")
    assert tree["posterior"]["push_error"].shape == (1, 4, 2)
    content = json.loads(answer("fit", *words, "--learner", "own_memory", "--pooled", "--json").out)
    assert content["free"] == ["push_error"]
    assert read_fit(tmp_path / "fit_lifts_2")["posterior"]["push_error"].shape == (1, 4)
    assert read_fit(tmp_path / "fit_lifts")["posterior"].equals(tree["posterior"])
    assert len(content["everyone"]["push_error"]) == 3
    assert {*content["participants"]["1"]} == {
        *("pushes", "log_score_left_out", "draws_left_out", "particle_noise"),
    }
    said = answer("compare-learners", *words, "--learner", "density", "--learner", "own_memory").out
    assert "own_memory: best for 2 of 2" in said
    assert "protected exceedance probability 0." in said
    assert len(pd.read_csv(tmp_path / "compare_lifts" / "comparison.csv")) == 4
    assert (tmp_path / "compare_lifts" / "pushes.png").exists()


def test_the_figure_of_pushes_has_people_and_each_learner(table):
    """Means over two people; own memory predicts the last lifts of the odd object, one density does not."""
    lifts = pd.read_csv(table)
    lifts.loc[lifts.index[-1], "force"] = np.nan
    lifts.to_csv(table.with_name("unknown.csv"), index=False)
    questions = [ask(table.with_name("unknown.csv"), learner) for learner in (DENSITY, OWN_MEMORY)]
    figure = draw_pushes(compare(questions), questions[0].lifts)
    assert [axes.get_title() for axes in figure.axes] == ["small, 0.6 kg", "large, 1.2 kg", "odd, 1.9 kg"]
    weight, people, density, own = (line.get_ydata() for line in figure.axes[2].lines)
    pushes = lifts[lifts["object"] == "odd"].groupby("observer")["force"].apply(np.array)
    np.testing.assert_allclose(people[:-1], np.mean([each[:-1] for each in pushes], axis=0))
    assert people[-1] == pytest.approx(np.nanmean([each[-1] for each in pushes]))
    assert own[4:] == pytest.approx(weight[0], rel=0.05)
    assert (density < 0.9 * weight[0]).all()


def test_groups_and_checks_as_commands(table, tmp_path):
    lifts = pd.read_csv(table)
    lifts["site"] = lifts["observer"].map({0: "here", 1: "there"})
    lifts.to_csv(tmp_path / "sites.csv", index=False)
    words = (tmp_path / "sites.csv", "--draws", 16, "--particles", 3, "--jobs", 1, "--out", tmp_path)
    said = answer("fit", *words, "--learner", "own_memory", "--group", "site", "--check").out
    assert "group here: push_error 0." in said
    assert "ratio there / here: push_error " in said
    assert "own_memory does not describe 0 of 2 people" in said
    assert (tmp_path / "fit_sites" / "check.png").exists()
    said = answer("compare-learners", *words, "--learner", "own_memory", "--check").out
    assert "None of these learners for 0 of 2 people." in said
    lifts.loc[3, "site"] = "there"
    lifts.to_csv(tmp_path / "sites.csv", index=False)
    problem = "sites.csv: site: is here and there for participant 0, must be one group"
    assert problem in refuse_command("fit", *words, "--learner", "own_memory", "--group", "site")
    problem = "--group: cannot be used with --pooled"
    assert problem in refuse_command("fit", *words, "--learner", "own_memory", "--group", "site", "--pooled")


def test_processes_import_no_module_of_the_working_folder(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "random.py").write_text(
        "raise ImportError('the random.py of the working folder')\n", encoding="utf-8"
    )
    end_processes()
    words = (table, "--draws", 4, "--particles", 3, "--jobs", 2, "--learner", "own_memory")
    assert answer("fit", *words).out.startswith("0: pushes 24, log_score -")
    end_processes()
    assert "PYTHONSAFEPATH" not in os.environ


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--free", "kappa"], "--set: participant.push_error: is 0, must be above 0, such as .2"),
        (["--free", "kapa"], "--free: is 'kapa', must be one of push_error, gain, lapse, kappa"),
        (["--free", "push_error,push_error"], "--free: has push_error twice"),
        (["--draws", "2"], "--draws: is 2, must be from 4 to 10000; the nearest is 4"),
        (["--draws", "10000", "--particles", "100"], "--draws: is 10000, must be at most 1000 with 100 particles"),
        (["--chains", "0"], "--chains: is 0, must be from 1 to 16; the nearest is 1"),
        (["--of", "people"], "lifts.csv: --of: is 'people', must be"),
        (["--set", "learner.kappa=2"], "--set: learner.kappa: has no effect here"),
        (
            ["--set", "participant.kappa_spread=0.3"],
            "--set: participant.kappa_spread: has no effect here: fits are of",
        ),
        (["--set", "participant.gain_spread=0.3"], "--set: participant.gain_spread: has no effect here"),
        (["--set", "point_estimate=mean"], "--set: point_estimate: has no effect here: fits use the most probable"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_one_line(table, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("fit", table, "--learner", "kinds_drawn", *words)


def test_a_learner_without_anything_to_fit_needs_an_error_of_the_push(table, tmp_path):
    fixed = {"participant": Participant(push_error=0.2)}
    assert ask(table, KINDS_DRAWN, free=["kappa"], **fixed).names == ["kappa"]
    assert "push_error: is 0, must be above 0" in refuse(ask, table, KINDS_DRAWN, free=["kappa", "own_drift"])
