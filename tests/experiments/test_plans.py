"""How much a study does, and what does not fit."""

from drake_affetto.experiments.plans import DemoPlan


def test_both_parts_learn_the_same_skill_from_the_same_demonstrations():
    plan = DemoPlan(seed=7)
    assert plan.mirror.demonstrations == plan.drum.demonstrations
    assert plan.mirror.direct == plan.drum.scenario
    assert plan.mirror.seed == plan.drum.seed == 7
