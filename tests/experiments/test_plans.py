"""How much a study does, and what does not fit."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments import plans
from drake_affetto.experiments.plans import DemoPlan, DrumPlan, MirrorPlan

PLANS = [DemoPlan, DrumPlan, MirrorPlan, plans.TeachPlan, plans.ToyPlan]


@pytest.mark.parametrize("kind", PLANS)
def test_defaults_fit_and_no_seed_is_below_zero(kind):
    plan = kind()
    plan.check()
    with pytest.raises(InputError, match="--seed is -1"):
        dataclasses.replace(plan, seed=-1).check()


def test_after_the_last_demonstration_there_is_always_a_test():
    assert DrumPlan(demonstrations=4).tested_after == [1, 2, 3, 4]
    assert DrumPlan(demonstrations=9, after=(5, 2)).tested_after == [2, 5, 9]
    with pytest.raises(InputError, match="--after"):
        DrumPlan(demonstrations=4, after=(5,)).check()


def test_there_are_as_many_demonstrations_as_samples():
    assert MirrorPlan().pool_size == 6
    assert MirrorPlan(samples=(3, 8)).pool_size == 8
    with pytest.raises(InputError, match="pool is 4"):
        MirrorPlan(samples=(5,), pool=4).check()
    with pytest.raises(InputError, match="choice"):
        MirrorPlan(choice="best").check()


def test_both_parts_learn_the_same_skill_from_the_same_demonstrations():
    plan = DemoPlan(seed=7)
    assert plan.mirror.demonstrations == plan.drum.demonstrations
    assert plan.mirror.direct == plan.drum.scenario
    assert plan.mirror.seed == plan.drum.seed == 7


@pytest.mark.parametrize(
    ("schemes", "message"),
    [
        (("nonsense",), "--schemes is 'nonsense', expected 'unchanged' or"),
        (("relearn", "relearn"), "each once"),
        ((), "each once"),
    ],
)
def test_schemes_are_known_and_named_once(schemes, message):
    with pytest.raises(InputError, match=message):
        MirrorPlan(schemes=schemes).check()


def test_bodies_take_the_place_of_repeats():
    assert MirrorPlan(bodies=3).repeats == 3
    assert DrumPlan(bodies=2, repeats=9).repeats == 2
    assert MirrorPlan().bodies == 0
