"""Strokes while somebody turns the mirror."""

import dataclasses

from experiments.test_self_calibration import PLAN, study
import numpy as np
import pytest

from drake_affetto.experiments.mirror_watch import watch, watch_result
from drake_affetto.experiments.self_calibration import Calibrated
from support.fake_mirrors import FakeMirrors


@pytest.fixture(scope="module")
def world():
    return FakeMirrors()


@pytest.fixture(scope="module")
def made(world):
    return study(world)


@pytest.fixture(scope="module")
def hand(made):
    return made.by_hand({each.number: each.mirror for each in made.repeats})


@pytest.fixture(scope="module")
def watched(made, hand):
    return watch(made, hand)


def test_a_turned_mirror_is_noticed_and_found_again(watched):
    result = watch_result(PLAN, watched)
    assert result.noticed.mean == 1.0
    assert result.false_alarms == 0
    assert result.quiet_strokes == 2 * (PLAN.quiet + PLAN.turned_after)
    assert result.recovered.mean >= 0.9
    # It takes a miss or a strange sight.
    assert all(delay >= 1 for delay in result.delays)


def test_by_strokes_alone_it_takes_longer(watched):
    for each in watched.values():
        alone = each.delay_by_strokes
        assert alone is None or alone >= each.delay


def test_the_hand_is_looked_at_only_where_strokes_give_reason(world, watched):
    looks = [s for s in world.specs if s["kind"] == "hand_look"]
    strikes = [s for s in world.specs if s["kind"] == "strike"]
    assert 0 < len(looks) < len(strikes)
    for each in watched.values():
        assert each.quiet_looks <= each.quiet_strokes / 2


def test_mirrors_are_turned_after_so_many_strokes(made, world, watched):
    for each in made.repeats:
        places = [
            tuple(spec["mirror"]["rotation"])
            for spec in world.specs
            if spec["kind"] == "strike"
            and spec["mirror"]["translation"] == each.mirror.translation
        ]
        before = places.count(tuple(each.mirror.rotation))
        assert before == PLAN.quiet + PLAN.turned_after
        assert places[:before] == before * [tuple(each.mirror.rotation)]
        assert set(places[before:]) == {tuple(each.turned.rotation)}


def test_a_mirror_that_stays_raises_no_alarm():
    plan = dataclasses.replace(PLAN, turned_by=0.0, repeats=1)
    made = study(FakeMirrors(), plan)
    mirrors = {each.number: each.mirror for each in made.repeats}
    result = watch_result(plan, watch(made, made.by_hand(mirrors)))
    assert result.delays == [None]
    assert result.noticed.mean == 0.0
    assert result.recovered is None


def test_a_repeat_without_a_mirror_is_not_watched(made, hand):
    lost = Calibrated(
        None, made.repeats[1].known, None, failure="nothing is seen"
    )
    assert set(watch(made, hand | {1: lost})) == {0}


def test_a_hand_that_hides_leaves_the_decision_to_what_is_seen(made, hand):
    """Where the hand shows at no posture any more, the mirror has moved."""
    blind = study(FakeMirrors(blind=True))
    result = watch_result(PLAN, watch(blind, hand))
    assert result.noticed.mean > 0.0
    assert np.isfinite(result.quiet_looks)
