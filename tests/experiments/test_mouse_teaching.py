"""Teaching by mouse: somebody drags the hand in Meshcat, as a browser would."""

import io

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import EventStatus
from pydrake.visualization import VisualizationConfig
import pytest
from rich.console import Console

from drake_affetto.cli import main as cli
from drake_affetto.experiments import mouse_teaching
from drake_affetto.experiments.episode import GuidedMovement
from drake_affetto.experiments.mouse_teaching import (
    camera_pose_for_stroke,
    teach_by_mouse,
)
from drake_affetto.experiments.plans import TeachPlan
from drake_affetto.experiments.recordings import GazeOutcome
from drake_affetto.experiments.teaching_session import TeachingSession
from drake_affetto.faults.supervisor import Verdict
from drake_affetto.motion.dmp import Dmp
from drake_affetto.motion.dmp_config import DmpConfig
from drake_affetto.sound.reward import RewardConfig
from drake_affetto.teaching import mouse_teacher
from drake_affetto.teaching.demonstrations import read_demonstrations
from support.mouse_messages import drag_message

HAS_SPRING = any(
    f.name == "mouse_interaction_stiffness"
    for f in VisualizationConfig.__fields__
)
FRAME = 1.0 / 60.0  # a browser's


class Person:
    """Looks at the lamp, and drags the hand down to the drum and back."""

    def __init__(self, trials, meshcat):
        self.trials, self.meshcat = trials, meshcat
        self.begin = None
        self.next_frame = 0.0

    def __call__(self, context):
        """Called after every step: one message a frame."""
        time = context.get_time()
        if self.begin is not None and time < self.begin:
            self.let_go()  # another trial has begun
        if time < self.next_frame and self.begin is not None:
            return EventStatus.DidNothing()
        lamp = self.meshcat.HasPath("/lesson/lamp")
        if lamp and self.begin is None:
            station = self.trials.station
            self.begin, self.palm = time, self.trials._palm()
            touching = station.touching_position(
                station.GetMyContextFromRoot(context)
            )
            self.way = touching - [0, 0, 0.05] - self.palm
            self.late = self.palm
        if self.begin is None:
            return EventStatus.DidNothing()
        if not lamp:
            self.let_go()
            return EventStatus.DidNothing()
        t = time - self.begin
        s = np.clip(min(t / 1.1, (2.5 - t) / 0.7), 0.0, 1.0)
        target = self.palm + s**2 * (3.0 - 2.0 * s) * self.way
        self.meshcat._InjectWebsocketMessage(
            drag_message(
                "/drake/visualizer/affetto/right_hand/visual",
                self.late.tolist(),
                target.tolist(),
            )
        )
        # The browser draws the hand where it was a frame ago.
        self.late = self.trials._palm()
        self.next_frame = time + FRAME
        return EventStatus.DidNothing()

    def let_go(self):
        self.meshcat._InjectWebsocketMessage(drag_message())
        self.begin = None


@pytest.mark.slow
@pytest.mark.skipif(
    not HAS_SPRING, reason="this version of Drake has no mouse spring"
)
def test_a_person_teaches(tmp_path, monkeypatch):
    meshcat = Meshcat()

    class Hurried(mouse_teaching.MouseTeachingRunner):
        """Not in real time, and with somebody at the mouse."""

        def __init__(self, *args):
            super().__init__(*args)
            assert self.simulator.get_target_realtime_rate() == 1.0
            self.simulator.set_target_realtime_rate(0.0)
            self.simulator.set_monitor(Person(self, meshcat))

    monkeypatch.setattr(mouse_teaching, "MouseTeachingRunner", Hurried)
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\ncamera: {renderer: analytic}\n")
    path = tmp_path / "taught.h5"
    course = TeachingSession(TeachPlan(1, str(mine)), path)
    console = Console(file=io.StringIO(), width=100)
    (taught,) = teach_by_mouse(course, console, meshcat=meshcat)
    assert (taught.attempts, taught.success) == (1, True)
    (found,) = read_demonstrations(path)
    strength = course.scenario.teaching.max_force
    assert 5.0 < found.max_pull <= strength + 1e-9
    assert found.t[-1] == pytest.approx(3.0, abs=0.011)
    assert found.q.shape == (len(found.t), 8)
    assert found.task_parameter.shape == (2,)
    assert found.reward == taught.reward > 0.15
    assert not meshcat.HasPath("/lesson/lamp")


class Rewards:
    """In place of the robot: replays sound as they are told to."""

    reward_config = RewardConfig()
    verdict = Verdict()

    def __init__(self, rewards, unseen=()):
        self.rewards, self.unseen = iter(rewards), iter(unseen)
        self.dmp = Dmp(DmpConfig())

    def gaze(self, xy, seed):
        seen = not next(self.unseen, False)
        return GazeOutcome(seen, np.array([0.4, 0.1]), 1.0)

    def wait_for_guidance(self, xy):
        t = np.arange(1, 301) / 100.0
        return GuidedMovement(t, np.zeros((300, 8)), np.zeros(120), 12.0)

    def strike(self, xy, theta, seed):
        return next(self.rewards)

    def reward(self, recording, taps):
        return recording

    def prototype(self, recording):
        return np.ones((3, 4))

    def tap_prototypes(self):
        return []


@pytest.fixture
def session(tmp_path, monkeypatch):
    """Teaches with given rewards and answers: (taught, course, told)."""
    monkeypatch.setattr(mouse_teaching, "require_mouse_spring", lambda: None)

    def run(count, rewards, answers, unseen=()):
        monkeypatch.setattr(
            mouse_teaching,
            "MouseTeachingRunner",
            lambda *_: Rewards(rewards, unseen),
        )
        course = TeachingSession(TeachPlan(count), tmp_path / "taught.h5")
        buffer = io.StringIO()
        told = []

        def ask(question):
            told.append(question)
            return answers.pop(0)

        taught = teach_by_mouse(
            course,
            Console(file=buffer, width=100),
            ask=ask,
            meshcat=Meshcat(),
        )
        assert not answers
        return taught, course, buffer.getvalue() + "".join(told)

    return run


def test_a_miss_is_repeated_if_the_person_likes(session):
    taught, course, told = session(1, [0.05, 0.12, 0.4], ["what?", "", ""])
    (first,) = taught
    assert (first.attempts, first.success, first.reward) == (3, True, 0.4)
    (found,) = read_demonstrations(course.path)
    assert (found.teacher, found.attempt) == ("by mouse", 2)
    assert (found.reward, found.max_pull) == (0.4, 12.0)
    assert "does not sound (R = 0.05)" in told
    assert "kept" in told


def test_a_place_can_be_left_and_all_can_be_stopped(session):
    taught, course, _ = session(4, [0.05, 0.4, 0.05], ["n", "q"])
    assert [each.success for each in taught] == [False, True, False]
    assert course.missing == [0, 2, 3]
    # Whoever comes back goes on with the places that are left.
    taught, course, told = session(
        4, [0.5, 0.6], [], unseen=[False, True, False]
    )
    assert [each.found for each in taught] == [True, True, False, True]
    assert course.missing == [2]
    assert "does not see it" in told
    assert [d.seed for d in read_demonstrations(course.path)] == [1, 0, 3]


def test_nobody_to_answer_stops():
    def closed(_):
        raise EOFError

    assert mouse_teaching._ask_after_miss(closed, 0.0) == "q"


@pytest.mark.parametrize("seed", range(10))
def test_the_stroke_lies_in_the_plane_of_the_screen(seed):
    rng = np.random.default_rng(seed)
    palm = np.array([0.16, -0.19, 0.14]) + rng.uniform(-0.02, 0.02, 3)
    touching = rng.uniform([0.17, -0.22, 0.05], [0.32, 0.03, 0.08])
    if seed == 0:
        touching[:2] = palm[:2]
    eye, middle = camera_pose_for_stroke(palm, touching)
    view = middle - eye
    assert view @ (touching - palm) == pytest.approx(0.0, abs=1e-12)
    # From the robot's right or front, not through it or the mirror on its
    # left; and not from below.
    assert eye[0] - eye[1] > 0.4
    assert eye[2] >= middle[2]
    assert np.linalg.norm(view) == pytest.approx(0.45)


def test_without_mouse_spring_there_is_a_clear_message(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(mouse_teacher, "_STIFFNESS", "no such field")
    out = tmp_path / "t.h5"
    assert cli.main(["teach", "--mouse", "--out", str(out)]) == 2
    assert "needs a Drake whose Meshcat" in capsys.readouterr().err
    assert not out.exists()
