"""`affetto teach --by-hand`: a person leads the hand with the mouse."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform

from drake_affetto.experiments.episode import Lesson, TrialRunner
from drake_affetto.experiments.teaching import Course, Taught
from drake_affetto.station.scenario import Scenario
from drake_affetto.teaching.demonstrations import Demonstration
from drake_affetto.teaching.mouse_teacher import require_mouse_spring

# How often is looked whether the hand is held, s.
_POLL = 0.02
# From where the person looks: how far, and from how far above the horizon.
_DISTANCE = 0.45
_TILT = np.radians(20.0)
# A lamp above the drum, outside of what the mouse can take hold of.
_LAMP = "/lesson/lamp"
_GREEN, _RED = Rgba(0.1, 0.8, 0.2), Rgba(0.9, 0.1, 0.1)


class HandsOnRunner(TrialRunner):
    """Trials in which a person leads the hand, in real time."""

    def __init__(self, scenario: Scenario, meshcat: Meshcat):
        """Builds a station that is taught by mouse in `meshcat`.

        Raises:
            InputError: if this version of Drake has no mouse spring.
        """
        super().__init__(scenario, meshcat, by_mouse=True)
        self._browser = meshcat

    def teach_by_mouse(self, xy: np.ndarray) -> Lesson:
        """Waits until the hand is taken hold of, and records from there.

        Args:
            xy: (2,) where the drum stands, m.
        """
        self._soften(xy)
        self._face_the_stroke()
        # Whoever still holds the hand has to let go of it first.
        self._wait(held=False)
        self._light(_GREEN)
        self._wait(held=True)
        self._light(_RED)
        try:
            return self._write_lesson(self.context.get_time())
        finally:
            self._browser.Delete(_LAMP)

    def _wait(self, *, held: bool) -> None:
        while bool(np.any(self.port("teacher.pulling_force"))) != held:
            self._advance(self.context.get_time() + _POLL)
            self._clear_logs()

    def _face_the_stroke(self) -> None:
        touching = self.station.touching_position(self._station_context)
        meshcat = self._browser
        meshcat.SetCameraPose(*viewpoint(self._palm(), touching))

    def _palm(self) -> np.ndarray:
        plant = self.station.plant
        palm = plant.GetFrameByName("right_palm")
        return palm.CalcPoseInWorld(self._sub(plant)).translation()

    def _light(self, colour: Rgba) -> None:
        drum = self.station.head_center_position(self._station_context)
        self._browser.SetObject(_LAMP, Sphere(0.012), colour)
        self._browser.SetTransform(
            _LAMP, RigidTransform(drum + [0.0, 0.0, 0.25])
        )


def viewpoint(
    palm: np.ndarray, touching: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """From where to look so that the stroke lies in the plane of the screen.

    The mouse moves what it holds in the plane that faces the viewer, so the
    way from palm to drum has to lie in it.

    Args:
        palm: (3,) where the palm is, m.
        touching: (3,) where it is to come, m.

    Returns:
        The camera's position and what it looks at, each (3,) m.
    """
    middle = 0.5 * (palm + touching)
    along = touching - palm
    across = np.array([along[1], -along[0], 0.0])
    if np.linalg.norm(across) < 1e-6:
        # The drum is right below the hand: any side will do.
        across = np.array([1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    # From the robot's right and front: the mirror is on its left.
    if across[0] < across[1]:
        across = -across
    along = along / np.linalg.norm(along)
    up = np.cross(across, along)
    up *= np.sign(up[2]) or 1.0
    away = np.cos(_TILT) * across + np.sin(_TILT) * up
    return middle + _DISTANCE * away, middle


def teach_by_hand(
    course: Course,
    console: Any,
    *,
    ask: Callable[[str], str] = input,
    meshcat: Meshcat | None = None,
) -> list[Taught]:
    """Lets a person teach at the places that are still missing.

    Args:
        console: a rich console that tells the person what to do.
        ask: how the person is asked what to do after a miss.
        meshcat: where the robot is shown; a new one by default.

    Returns:
        What came of each place that was taught at.

    Raises:
        InputError: if this version of Drake has no mouse spring.
    """
    require_mouse_spring()
    course.scenario.simulator_config.target_realtime_rate = 1.0
    if meshcat is None:
        from pydrake.geometry import StartMeshcat

        meshcat = StartMeshcat()
    trials = HandsOnRunner(course.scenario, meshcat)
    console.print(
        f"Open {meshcat.web_url()} beside this window.\n"
        "While the lamp over the drum is green, take hold of the robot's right "
        "hand:\nhold Ctrl and drag it with the left mouse button. The lamp "
        f"turns red: within\n{course.scenario.teaching.duration:g} s lead the "
        "hand onto the drum, press a little, and lead it back.\n"
        "Then the robot repeats it, and the drum's sound decides.",
        soft_wrap=True,
    )
    outcomes: dict[int, Taught] = {}
    taps = trials.taps()
    for i in course.missing:
        xy, seed = course.positions[i], course.seed(i)
        console.print(
            f"Position {i + 1} of {len(course.positions)}: the robot looks for "
            "the drum."
        )
        look = trials.look(xy, seed)
        outcome = Taught(xy, look.found, 0, False, 0.0, 0.0)
        outcomes[i] = outcome
        if not look.found:
            console.print("It does not see it; on to the next.")
            continue
        answer = ""
        while answer == "" and not outcome.success:
            console.print("Your turn.")
            lesson = trials.teach_by_mouse(xy)
            console.print("Now the robot repeats it.")
            recording = trials.play(
                xy, lesson.theta, seed + 7919 * (outcome.attempts + 1)
            )
            reward = trials.reward(recording, taps)
            outcome.attempts += 1
            outcome.max_pull = max(outcome.max_pull, lesson.max_pull)
            outcome.reward = max(outcome.reward, reward)
            if reward > trials.reward_config.threshold:
                outcome.success = True
                course.keep(
                    i,
                    Demonstration(
                        t=lesson.t,
                        q=lesson.q,
                        joint_names=tuple(course.scenario.active_joints),
                        drum_xy=xy,
                        seed=seed,
                        attempt=outcome.attempts - 1,
                        theta=lesson.theta,
                        task_parameter=look.task_parameter,
                        reward=reward,
                        prototype=trials.prototype(recording),
                        max_pull=outcome.max_pull,
                        teacher="by mouse",
                        scenario=course.scenario_name,
                    ),
                )
                console.print(f"The drum sounds (R = {reward:.2f}): kept.")
            else:
                answer = _ask_after_miss(ask, reward)
        if answer == "q":
            break
    return [
        outcomes[i] if i in outcomes else course.outcome(i)
        for i in range(len(course.positions))
        if i in outcomes or i in course.taught
    ]


def _ask_after_miss(ask: Callable[[str], str], reward: float) -> str:
    """ "" to repeat, "n" for the next position, "q" to stop."""
    question = (
        f"The drum does not sound (R = {reward:.2f}). Enter: once more, a "
        "little more firmly; n: next position; q: stop. "
    )
    while True:
        try:
            answer = ask(question).strip().lower()
        except EOFError:
            return "q"
        if answer in ("", "n", "q"):
            return answer
