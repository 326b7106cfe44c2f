"""The study of changed views: planned in a fake world, and a small real one."""

import contextlib
import dataclasses
import json

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments.mirror import choose, run_mirror
from drake_affetto.experiments.plans import MirrorPlan
from drake_affetto.experiments.skills import fit_scheme, make_skill
from drake_affetto.experiments.trials import run_task
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.skill.scheme_names import SCHEMES
from drake_affetto.station.scenario import load_scenario
from support import fake_world

# A scenario whose default map is affine, as the views of the fake world are.
PLAN = MirrorPlan(
    scenario="mirror_and_camera", repeats=4, evaluations=5, demonstrations=16
)
SMALL = dataclasses.replace(PLAN, repeats=2, evaluations=3, demonstrations=8)


def in_fake_world(path, plan, run=fake_world.run):
    with (
        TrialStore(path) as store,
        TrialExecutor(run, store, workers=0, quiet=True) as executor,
    ):
        return run_mirror(executor, plan)


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    return in_fake_world(tmp_path_factory.mktemp("m") / "t.sqlite", PLAN)


def test_results_hold_what_is_promised(outcome):
    results = to_plain(outcome.results)
    assert list(results["schemes"]) == list(SCHEMES)
    for scheme in results["schemes"].values():
        assert list(scheme) == ["1", "2", "3", "4", "5"]
        for row in scheme.values():
            rate = row["success_rate"]
            assert rate["low"] <= rate["mean"] <= rate["high"]
            assert len(row["per_repeat"]) == 4
            assert len(row["rewards"]) == 4 * 5
            assert len(row["landing"]) == 4 * 5
            assert 0.0 <= row["grazes"] <= 1.0
            hits = np.array(row["rewards"]).reshape(4, 5) > 0.15
            assert row["per_repeat"] == hits.mean(axis=1).tolist()
    # Every pair by success; by landing the pairs that were named beforehand.
    rows = results["comparisons"]
    assert len(rows) == 5 * 28 + 5 * 2
    assert sum(row["measure"] == "landing" for row in rows) == 5 * 2
    primary = [row for row in rows if row["primary"]]
    assert {
        (row["a"], row["b"], row["samples"], row["measure"]) for row in primary
    } == {
        (*pair, samples, measure)
        for pair in (
            ("relearn", "transfer"),
            ("relearn", "transfer_default"),
        )
        for samples in (2, 3)
        for measure in ("success",)
    } | {
        (scheme, "relearn", samples, "landing")
        for scheme in ("transfer", "transfer_default")
        for samples in (2, 3)
    }
    for row in rows:
        if row["measure"] == "success" or row["primary"]:
            assert row["p"] <= row["p_corrected"] <= 1.0
    chance = results["chance"]
    assert chance["low"] <= chance["mean"] <= chance["high"]
    json.dumps(results, allow_nan=False)


def test_transfer_is_good_where_views_differ_by_an_affine_map(outcome):
    rates = {
        name: scheme["5"]["success_rate"]["mean"]
        for name, scheme in to_plain(outcome.results)["schemes"].items()
    }
    assert rates["transfer_default"] >= 0.9
    assert rates["unchanged"] < 0.5
    # The map that was learned is the one between the two views.
    example = to_plain(outcome.results)["map"]
    assert np.shape(example["input"]) == np.shape(example["output"])
    A, b = fake_world.VIEWS["mirror"]
    B, c = fake_world.VIEWS["drumming"]
    xy = np.linalg.solve(A, (np.array(example["taught_input"]) - b).T).T
    np.testing.assert_allclose(
        example["taught_output"], xy @ B.T + c, atol=0.05
    )


def test_schemes_meet_the_same_trials(tmp_path):
    seen = []

    def run(spec):
        if spec["kind"] == "strike":
            seen.append((tuple(spec["xy"]), spec["seed"], spec["theta"]))
        return fake_world.run(spec)

    in_fake_world(tmp_path / "t.sqlite", SMALL, run)
    places = {(xy, seed) for xy, seed, _ in seen}
    assert len(places) == 2 * 3
    # What is left unchanged does not depend on the samples: it ran once.
    # So did the constant stroke that is played blind. Here the default's map
    # is affine; and from one sample the Gaussian process and the regression
    # know one and the same constant.
    assert len(seen) == 2 * 3 * (6 * 5 - 1 + 1 + 1)


def test_halves_of_a_study_make_the_whole(tmp_path):
    """Two machines ran half of the trials each; the union is the study."""
    for parity in (0, 1):

        def half(spec, parity=parity):
            # Looks and lessons run on both, strikes on one of them.
            if spec["kind"] == "strike" and spec["seed"] % 2 != parity:
                raise KeyboardInterrupt
            return fake_world.run(spec)

        path = tmp_path / f"{parity}.sqlite"
        with TrialStore(path) as store:
            # Specs in an order of its own, until it has all of its half.
            Greedy(half, store).study()
    with TrialStore(tmp_path / "union.sqlite") as store:
        sizes = [store.merge(tmp_path / f"{p}.sqlite") for p in (0, 1)]
        assert all(sizes)
        assert store.merge(tmp_path / "1.sqlite") == 0
        with TrialExecutor(never, store, workers=0, quiet=True) as executor:
            again = run_mirror(executor, SMALL)
    whole = in_fake_world(tmp_path / "whole.sqlite", SMALL)
    assert again.results == whole.results


def never(spec):
    raise AssertionError(f"{spec['kind']} ran although it was finished")


class Greedy:
    """Keeps of a study what its half of the trials gives."""

    def __init__(self, run, store):
        self.run, self.store = run, store

    def study(self):
        def keep(spec):
            result = fake_world.run(spec)
            with contextlib.suppress(KeyboardInterrupt):
                self.store.put(spec, *self.run(spec))
            return result

        with (
            TrialStore(":memory:") as scratch,
            TrialExecutor(keep, scratch, workers=0, quiet=True) as executor,
        ):
            run_mirror(executor, SMALL)


def test_samples_are_chosen_at_random_or_spread_out():
    tau = np.random.default_rng(1).random((12, 2))

    def least(how, seed):
        chosen = choose(tau, 4, how, np.random.default_rng(seed))
        assert len(set(chosen.tolist())) == 4
        apart = np.linalg.norm(tau[chosen][:, None] - tau[chosen], axis=-1)
        return apart[~np.eye(4, dtype=bool)].min()

    seeds = range(30)
    random, spread = (
        [least(how, seed) for seed in seeds] for how in ("random", "spread")
    )
    assert np.mean(spread) > 1.5 * np.mean(random)


def test_a_scenario_says_which_map_is_learned(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("extends: mirror\ntransfer:\n  mapping: similarity\n")
    rng = np.random.default_rng(0)
    X = rng.uniform([0.0, -0.5], [1.0, 0.5], size=(20, 2))
    skill = make_skill(load_scenario("drumming").skill, 0)
    skill.fit(X, np.hstack([X, X**2]))
    few = X[:4]
    y = skill.predict(few)
    scheme = fit_scheme(
        "transfer_default", skill, few, y, str(path), "drumming"
    )
    assert scheme.mapping == "similarity"
    assert scheme.residual is None
    path.write_text(
        "extends: mirror\ntransfer: {mapping: affine, residual: true}\n"
    )
    scheme = fit_scheme(
        "transfer_default", skill, few, y, str(path), "drumming"
    )
    assert scheme.residual_ is not None
    path.write_text("extends: mirror\ntransfer: {mapping: afine}\n")
    with pytest.raises(InputError, match=r"transfer\.mapping is 'afine'"):
        load_scenario(path)


@pytest.mark.slow
def test_a_small_study_on_the_robot(tmp_path):
    """With the map that knows optics, as the scenario has it."""
    assert load_scenario("mirror").transfer.mapping == "optical"
    plan = MirrorPlan(
        samples=(2,),
        repeats=1,
        evaluations=1,
        demonstrations=3,
        pool=2,
        schemes=("unchanged", "transfer_default"),
    )
    outcome = in_fake_world(tmp_path / "t.sqlite", plan, run_task)
    results = to_plain(outcome.results)
    for scheme in results["schemes"].values():
        assert len(scheme["2"]["rewards"]) == 1
    assert results["map"]["input_names"] == ["x_img", "y_img"]
