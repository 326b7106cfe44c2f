"""`affetto teach --mouse`: a person guides the hand with the mouse."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform

from drake_affetto.experiments.episode import GuidedMovement, TrialRunner
from drake_affetto.experiments.results import DemonstrationResult
from drake_affetto.experiments.teaching_session import TeachingSession
from drake_affetto.experiments.trials import demonstrate
from drake_affetto.scene.parts import find_frame
from drake_affetto.station.scenario import Scenario
from drake_affetto.teaching.mouse_teacher import require_mouse_spring

# Time between two checks whether the hand is held, s.
_POLL = 0.02
# Distance and elevation of the camera.
_DISTANCE = 0.45
_TILT = np.radians(20.0)
# A lamp above the drum, outside of what the mouse can take hold of.
_LAMP = "/lesson/lamp"
_GREEN, _RED = Rgba(0.1, 0.8, 0.2), Rgba(0.9, 0.1, 0.1)


class MouseTeachingRunner(TrialRunner):
    """Trials in which a person guides the hand, in real time."""

    def __init__(self, scenario: Scenario, meshcat: Meshcat):
        """Builds a station that is taught by mouse in `meshcat`.

        Raises:
            InputError: if this version of Drake has no mouse spring.
        """
        super().__init__(scenario, meshcat, by_mouse=True)
        self._browser = meshcat

    def wait_for_guidance(self, xy: np.ndarray) -> GuidedMovement:
        """Waits until a person holds the hand, and records from there.

        Args:
            xy: Position of the drum (2,), m.
        """
        self._soften(xy, self.scenario.random_seed)
        self._show_stroke()
        # A person who still holds the hand has to let go of it first.
        self._wait(held=False)
        self._light(_GREEN)
        self._wait(held=True)
        self._light(_RED)
        try:
            return self._record_guidance(self.context.get_time())
        finally:
            self._browser.Delete(_LAMP)

    def _wait(self, *, held: bool) -> None:
        while bool(np.any(self.port("teacher.pulling_force"))) != held:
            self.advance(self.context.get_time() + _POLL)
            self._clear_logs()

    def _show_stroke(self) -> None:
        touching = self.station.touching_position(self._station_context)
        meshcat = self._browser
        meshcat.SetCameraPose(*camera_pose_for_stroke(self._palm(), touching))

    def _palm(self) -> np.ndarray:
        plant = self.station.plant
        palm = find_frame(plant, "affetto::right_palm")
        return palm.CalcPoseInWorld(self._sub(plant)).translation()

    def _light(self, color: Rgba) -> None:
        drum = self.station.head_center_position(self._station_context)
        self._browser.SetObject(_LAMP, Sphere(0.012), color)
        self._browser.SetTransform(
            _LAMP, RigidTransform(drum + [0.0, 0.0, 0.25])
        )


def camera_pose_for_stroke(
    palm: np.ndarray, touching: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A camera pose from which the stroke lies in the plane of the screen.

    The mouse moves what it holds in the plane that faces the viewer, so the
    way from palm to drum has to lie in it.

    Args:
        palm: Position of the palm (3,), m.
        touching: Position where it touches the drum (3,), m.

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


def teach_by_mouse(
    session: TeachingSession,
    console: Any,
    *,
    ask: Callable[[str], str] = input,
    meshcat: Meshcat | None = None,
) -> list[DemonstrationResult]:
    """Lets a person teach at the positions that the file does not have.

    Args:
        session: Positions and file.
        console: A rich console that tells the person what to do.
        ask: Asks the person what to do after a miss.
        meshcat: Browser window with the robot; a new one by default.

    Returns:
        The demonstration at each position that was reached.

    Raises:
        InputError: If this version of Drake has no mouse spring.
    """
    require_mouse_spring()
    session.scenario.simulator_config.target_realtime_rate = 1.0
    if meshcat is None:
        from pydrake.geometry import StartMeshcat

        meshcat = StartMeshcat()
    trials = MouseTeachingRunner(session.scenario, meshcat)
    console.print(
        f"Open {meshcat.web_url()} beside this window.\n"
        "While the lamp over the drum is green, take hold of the robot's right "
        "hand:\nhold Ctrl and drag it with the left mouse button. The lamp "
        f"turns red: within\n{session.scenario.teaching.duration:g} s lead "
        "the hand onto the drum, press a little, and lead it back.\n"
        "Then the robot repeats it, and the drum's sound decides.",
        soft_wrap=True,
    )
    results: dict[int, DemonstrationResult] = {}
    answer = ""

    def try_again(attempts: int, reward: float) -> bool:
        nonlocal answer
        answer = _ask_after_miss(ask, reward)
        return answer == ""

    for i in session.missing:
        xy = session.positions[i]

        def guide(attempt: int, xy: np.ndarray = xy) -> GuidedMovement:
            console.print("Your turn.")
            movement = trials.wait_for_guidance(xy)
            console.print("Now the robot repeats it.")
            return movement

        console.print(
            f"Position {i + 1} of {len(session.positions)}: the robot looks "
            "for the drum."
        )
        results[i] = demonstrate(trials, xy, session.seed(i), guide, try_again)
        if not results[i].found:
            console.print("It does not see it; on to the next.")
        elif results[i].success:
            session.keep(i, results[i], "by mouse")
            reward = results[i].reward
            console.print(f"The drum sounds (R = {reward:.2f}): kept.")
        elif answer == "q":
            break
    return [
        results[i] if i in results else session.result(i)
        for i in range(len(session.positions))
        if i in results or i in session.taught
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
