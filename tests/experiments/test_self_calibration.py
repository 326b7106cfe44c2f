"""The robot's decisions see no more than the robot does."""

import dataclasses
import inspect
from pathlib import Path
import typing

import numpy as np

from drake_affetto.calibration import (
    belief,
    ellipse,
    hand,
    knowledge,
    plane,
    postures,
    recheck,
    watch,
)
from drake_affetto.experiments.bodies import draw_robots
from drake_affetto.experiments.mirror_setup import judge_plane
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.self_calibration import (
    Drum,
    MirroredSkill,
    SelfCalibration,
    belief_transform,
)
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.scene.world import FramePose
from support.fake_mirrors import FakeMirrors, setup

PLAN = SelfCalibrationPlan(
    settings=str(Path(__file__).parent / "data/quick_self_calibration.yaml"),
    repeats=2,
    evaluations=3,
    demonstrations=8,
    skills=1,
    samples=(3,),
)
ROOM = (belief, ellipse, hand, knowledge, plane, postures, recheck, watch)


def study(world, plan=PLAN):
    store = TrialStore(":memory:")
    executor = TrialExecutor(world, store, workers=0, quiet=True)
    executor.__enter__()
    made = SelfCalibration(executor, plan)
    made.set_up()
    return made


def test_the_robots_room_has_no_place_for_a_true_mirror():
    """Nothing in it takes a pose of a mirror, or a result of the judges."""
    for module in ROOM:
        for name, member in inspect.getmembers(module):
            if getattr(member, "__module__", None) != module.__name__:
                continue
            parts = [member]
            if inspect.isclass(member):
                parts += [
                    each
                    for _, each in inspect.getmembers(
                        member, inspect.isfunction
                    )
                ]
            for part in parts:
                hints = typing.get_type_hints(part) if callable(part) else {}
                for kind in hints.values():
                    assert "FramePose" not in str(kind), name
                    assert "camera_model.Mirror" not in str(kind), name
                if inspect.isfunction(part):
                    wanted = set(inspect.signature(part).parameters)
                    assert not wanted & {"X_WM", "mirror", "pose"}, name
    for look, fields in (
        (hand.HandLook, {"readings", "pixel"}),
        (ellipse.EllipseLook, {"center", "moments"}),
    ):
        assert {each.name for each in dataclasses.fields(look)} == fields


def test_what_it_finds_depends_on_what_it_sees_alone():
    """The world shows one mirror; the study believes it set up others."""
    shown = dataclasses.asdict(setup().nominal_pose())
    found = []
    for shift in (0.0, 0.02):
        plan = dataclasses.replace(PLAN, repeats=1)
        made = study(FakeMirrors(always=shown), plan)
        mirrors = {}
        for each in made.repeats:
            moved = (np.array(each.mirror.translation) + shift).tolist()
            each.mirror = FramePose(moved, list(each.mirror.rotation))
            mirrors[each.number] = each.mirror
        both = made.by_hand(mirrors), made.by_ellipse()
        found.append(
            [each[i].plane.parameters for each in both for i in mirrors]
        )
        # It is the mirror that is shown.
        for each in both:
            for i in mirrors:
                judged = judge_plane(each[i].plane, FramePose(**shown))
                assert np.degrees(judged.angle) < 3.0
    np.testing.assert_array_equal(*found)


def test_hand_and_ellipse_find_each_mirror():
    world = FakeMirrors()
    made = study(world)
    mirrors = {each.number: each.mirror for each in made.repeats}
    for found in (made.by_hand(mirrors), made.by_ellipse()):
        for each in made.repeats:
            judged = judge_plane(found[each.number].plane, each.mirror)
            assert np.degrees(judged.angle) < 2.5
            assert found[each.number].failure is None
            assert 0 < found[each.number].looks <= 12
    looks = [spec for spec in world.specs if spec["kind"] == "hand_look"]
    assert {tuple(spec["mirror"]["translation"]) for spec in looks} == {
        tuple(each.mirror.translation) for each in made.repeats
    }


def test_a_robot_that_sees_nothing_says_so():
    made = study(FakeMirrors(blind=True))
    found = made.by_hand({0: made.repeats[0].mirror})
    assert found[0].plane is None
    assert "not seen in the mirror at any of 12" in found[0].failure
    assert found[0].looks == 12


def test_it_drums_by_what_it_found():
    made = study(FakeMirrors())
    each = made.repeats[0]
    found = made.by_ellipse()
    xy = each.positions[0]
    drum = Drum(each, each.mirror, xy, 5)
    gaze = made.look_at("Looking", {0: drum})[0]
    mover = MirroredSkill(each.skill, found[0].to_direct)
    spec = made.strike_spec(drum, gaze, mover)
    struck = made.strike("Drumming", {0: spec})
    assert struck[0].success
    first = made.first_beliefs("ellipse", found)[0]
    tau = np.array([gaze.tau])
    np.testing.assert_allclose(
        belief_transform(first)(tau), found[0].to_direct(tau), atol=0.15
    )


def test_a_lost_drum_is_not_struck():
    made = study(FakeMirrors())
    each = made.repeats[0]
    drum = Drum(each, each.mirror, each.positions[0], 5)
    seen = made.look_at("Looking", {0: drum})[0]
    lost = dataclasses.replace(seen, found=False)
    assert made.strike_spec(drum, lost, None) is None


def test_an_unreachable_box_fails_before_any_look(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("hand: {space_low: [1, 1, 1], space_high: [2, 2, 2]}\n")
    plan = dataclasses.replace(PLAN, settings=str(path))
    made = study(FakeMirrors(), plan)
    found = made.by_hand({0: made.repeats[0].mirror})
    assert "no posture brings" in found[0].failure


def test_bodies_have_scenarios_and_skills_of_their_own(tmp_path):
    """Robots in one group; each is asked in its own scenario."""
    plan = dataclasses.replace(PLAN, bodies=2)
    robots = draw_robots(2, plan.scenario, (0,), tmp_path)
    world = FakeMirrors()
    store = TrialStore(":memory:")
    with TrialExecutor(world, store, workers=0, quiet=True) as executor:
        made = SelfCalibration(executor, plan, range(2), robots)
        made.set_up()
        first, second = made.repeats
        made.look_at(
            "Looking",
            {
                each.number: Drum(each, each.mirror, each.positions[0], 5)
                for each in made.repeats
            },
        )
    names = {Path(s["scenario"]["@name"]).name for s in world.specs}
    assert names == {
        f"{view}_{i:02d}.yaml"
        for view in ("drumming", "mirror")
        for i in (0, 1)
    }
    assert first.skill is not second.skill
    # Its camera sits elsewhere.
    apart = np.subtract(first.known.eye_chain.X_JT, second.known.eye_chain.X_JT)
    assert np.abs(apart).max() > 1e-3
