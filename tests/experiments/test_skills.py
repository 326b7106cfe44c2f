"""Skills and their trials, in a world where trials take no time."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments import skills
from drake_affetto.experiments.results import GazeResult
from drake_affetto.experiments.trials import strike
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.station.scenario import load_scenario
from support import fake_world


@pytest.fixture
def executor(tmp_path):
    with (
        TrialStore(tmp_path / "trials.sqlite") as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as made,
    ):
        yield made


def test_all_that_is_taught_has_succeeded(executor):
    # Some of the positions fail, and others take their place.
    taught = skills.teach_positions(executor, "taught", "drumming", 40, (0, 1))
    assert len(taught) == 40
    assert all(each.success for each in taught)
    assert executor._store.phases()[1].label == "taught, further positions"
    assert skills.task_parameters(taught).shape == (40, 2)
    assert skills.stack_prototypes(taught).shape == (40, 4, 5)


def test_a_skill_knows_what_came_before_and_nothing_later(executor):
    config = load_scenario("drumming").skill
    taught = skills.teach_positions(executor, "taught", "drumming", 5, (0, 1))
    by_count = skills.skills_by_count(config, taught, 3)
    assert [skill.n_samples_seen_ for skill in by_count] == [1, 2, 3, 4, 5]
    tau = skills.task_parameters(taught)
    whole = skills.learn_skill(config, taught, 3)
    np.testing.assert_array_equal(whole.predict(tau), by_count[-1].predict(tau))
    with pytest.raises(InputError, match="only 2 demonstrations"):
        skills.learn_skill(config, taught[:2], 3)


def test_a_drum_that_was_not_found_is_not_struck(executor):
    class Still:
        def predict(self, tau):
            return np.zeros((len(tau), fake_world.FEATURES))

    tests = {
        found: skills.strike_if_seen(
            "drumming",
            [0.2, -0.1],
            5,
            GazeResult(found, [0.1, 0.2], 1.0),
            Still(),
            np.zeros((1, 4, 5)),
        )
        for found in (False, True)
    }
    assert tests[False] is None
    strikes = skills.run_strikes(executor, "strikes", tests)
    assert list(strikes) == [False, True]
    assert strikes[False] is None
    assert strikes[True].reward == 0.0
    assert executor._store.phases()[0].total == 1


def sometimes_invalid(spec):
    """Strikes of an even seed are not valid, whatever they sound like."""
    result, arrays = fake_world.run(spec)
    if spec["kind"] == "strike" and spec["seed"] % 2 == 0:
        result = result | {"success": False, "invalid": "commands come late"}
    return result, arrays


def test_strikes_that_are_not_valid_are_repeated_with_another_seed(tmp_path):
    theta, sounds = np.array([0.25, -0.1]), np.ones((1, 4, 5))
    tests = {
        seed: strike("drumming", [0.25, -0.1], seed, theta, sounds)
        for seed in range(12)
    }

    def invalid(repeat):
        with (
            TrialStore(tmp_path / f"{repeat}.sqlite") as store,
            TrialExecutor(
                sometimes_invalid, store, workers=0, quiet=True
            ) as executor,
        ):
            found = skills.run_strikes(executor, "strikes", tests, repeat)
        assert list(found) == list(tests)
        return [seed for seed, each in found.items() if each.invalid]

    assert invalid(0) == [0, 2, 4, 6, 8, 10]
    assert len(invalid(2)) < 6
    assert invalid(20) == []
