"""One movement an episode: see the drum, strike it, hear how it sounded."""

from pathlib import Path
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np
from pydrake.systems.framework import Context

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_choice,
)
from drake_affetto.common.typing import Array, Image
from drake_affetto.envs.lessons import load_lessons
from drake_affetto.envs.movements import MovementSpace
from drake_affetto.envs.scene_picture import (
    RENDER_MODES,
    open_window,
    take_picture,
)
from drake_affetto.experiments import trials
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.results.trial import GazeResult, StrikeResult
from drake_affetto.station.scenario import Scenario, load_scenario

# Places of the drum in a row that may not be found by the gaze.
_MOST_PLACES = 50


class DrumEnv(gymnasium.Env):
    """A contextual bandit: a movement for what is seen, paid by its sound.

    - Observation (2,): the task parameter τ that the gaze found, scaled: the
      range of the scenario's skill is [-1, 1]; clipped to [-2, 2].
    - Action (k,) in [-1, 1]: a movement, see `MovementSpace`.
    - Reward: R of the sound (paper Eq. 10), at most 1; success is R > 0.15.
    - An episode is one step. `reset` puts the drum at a new place of the
      scenario's region, or at `options={"xy": [x, y]}`, m.
    - `info` has `theta` and `success`, and of what a learner must not know
      `max_force`, N, and `impulse`, N s, on the drum's head.

    Neither observation nor reward reads where the drum is.
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 1}  # noqa: RUF012

    def __init__(
        self,
        scenario: str = "drumming",
        *,
        directions: int | None = 3,
        lessons: int | str | Path = 16,
        render_mode: str | None = None,
    ):
        """Loads the lessons; the first on a machine are taught (15 s).

        Args:
            scenario: Scenario, by name or path.
            directions: Number of the lessons' principal directions that an
                action spans; None for all of θ.
            lessons: Number of lessons in the direct view, or a file of
                `affetto teach`.
            render_mode: "rgb_array": `render` gives a picture of the strike
                from outside. "human": Meshcat shows it, in a browser.

        Raises:
            InputError: If an argument or the scenario does not fit.
        """
        require_choice("render_mode", render_mode, None, *RENDER_MODES)
        self.render_mode = render_mode
        self._name = scenario
        self._scenario: Scenario = load_scenario(scenario)
        known = load_lessons("drumming", lessons)
        self.movements = MovementSpace(known.theta, directions)
        self._prototypes = known.prototypes
        self.observation_space = spaces.Box(-2.0, 2.0, (2,), np.float32)
        self.action_space = spaces.Box(
            -1.0, 1.0, (self.movements.size,), np.float32
        )
        self._runners: dict[str, TrialRunner] = {}
        if render_mode == "human":
            self._runners[scenario] = TrialRunner(self._scenario, open_window())
        self._xy: Array | None = None
        self._seed = 0
        self._observation = np.zeros(2, np.float32)
        self._picture: Image | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Puts the drum somewhere and looks at it.

        Args:
            options: None, or `{"xy": [x, y]}`, where the drum stands, m.

        Raises:
            InputError: If the drum cannot be seen there.
        """
        super().reset(seed=seed)
        self._xy, tau, self._seed = look_at_new_place(
            self._name, self._scenario, self.np_random, options, self._runners
        )
        self._observation = scaled_tau(self._scenario, tau)
        if self.render_mode == "rgb_array":
            self._picture = self._take(self._runner().context)
        return self._observation.copy(), {}

    def step(
        self, action: np.ndarray
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Strikes; the episode is over then.

        Args:
            action: The movement (k,), each entry in [-1, 1].

        Raises:
            InputError: If the action does not fit, or there was no reset.
        """
        theta = self.movements.theta(action)
        if self._xy is None:
            raise InputError("the episode is over: call reset() before step()")
        result = self._strike(
            trials.strike(
                self._name,
                self._xy.tolist(),
                self._seed,
                theta,
                self._prototypes,
            )
        )
        self._xy = None
        info = {
            "theta": theta,
            "success": result.success,
            "max_force": result.max_force,
            "impulse": result.impulse,
        }
        return self._observation.copy(), float(result.reward), True, False, info

    def render(self) -> Image | None:  # type: ignore[override]
        """The strike from outside as RGB; None in the other modes."""
        return self._picture

    def close(self) -> None:
        """Closes the browser's server."""
        self._runners.clear()

    def _runner(self) -> TrialRunner:
        return self._runners.get(self._name) or trials.runner(self._name)

    def _strike(self, spec: trials.Spec) -> StrikeResult:
        """Runs a strike; takes its picture as the hand touches the drum.

        Without a touch it is that of the movement's middle.
        """
        if self.render_mode != "rgb_array":
            return self._typed(spec)
        runner = self._runner()
        touched: list[Image] = []
        halfway: list[Image] = []

        def watch(root: Context) -> None:
            start = runner.port("affetto.start_time")[0]
            middle = start + 0.5 * self._scenario.dmp.duration
            if not touched and runner.port("drum.contact_force")[0] > 0.0:
                touched.append(self._take(root))
            if not halfway and root.get_time() >= middle:
                halfway.append(self._take(root))

        runner.simulator.set_monitor(watch)
        try:
            result = self._typed(spec)
        finally:
            runner.simulator.clear_monitor()
        self._picture = (touched + halfway)[0]
        return result

    def _typed(self, spec: trials.Spec) -> StrikeResult:
        result = trials.run_trial(spec, self._runners)
        assert isinstance(result, StrikeResult)
        return result

    def _take(self, root: Context) -> Image:
        return take_picture(self._runner().station, root)


def look_at_new_place(
    name: str,
    scenario: Scenario,
    rng: np.random.Generator,
    options: dict[str, Any] | None,
    runners: dict[str, TrialRunner],
) -> tuple[Array, list[float], int]:
    """Puts the drum where the gaze finds it; gives place, τ and trial's seed.

    Args:
        name: Name or path of the scenario.
        scenario: The scenario.
        rng: Source of randomness.
        options: Those of `reset`: `xy`, or none.
        runners: Runners to use instead of this process's own.

    Raises:
        InputError: If an option does not fit, or the gaze finds no drum.
    """
    options = options or {}
    require(set(options) <= {"xy"}, "options", sorted(options), "xy or none")
    places = 1 if "xy" in options else _MOST_PLACES
    for _ in range(places):
        if "xy" in options:
            xy = require_array("options['xy']", options["xy"], (2,))
        else:
            xy = trials.draw_positions(scenario, 1, rng)[0]
        seed = int(rng.integers(2**31))
        seen = trials.run_trial(trials.look(name, xy.tolist(), seed), runners)
        assert isinstance(seen, GazeResult)
        if seen.found:
            return xy, seen.tau, seed
    raise InputError(
        f"the gaze does not find the drum at {xy.tolist()} in {name!r}"
    )


def scaled_tau(scenario: Scenario, tau: list[float]) -> np.ndarray:
    """τ (2,) with the range of the scenario's skill as [-1, 1], as float32."""
    low, high = np.array(scenario.skill.input_range).T
    scaled = 2.0 * (np.array(tau) - low) / (high - low) - 1.0
    return np.clip(scaled, -2.0, 2.0).astype(np.float32)
