"""Joint targets at 20 Hz: learn the movement itself."""

import dataclasses
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np

from drake_affetto.common.errors import (
    InputError,
    require_array,
    require_choice,
    require_range,
)
from drake_affetto.common.typing import Array, Image
from drake_affetto.envs.drum import look_at_new_place, scaled_tau
from drake_affetto.envs.lessons import load_lessons
from drake_affetto.envs.scene_picture import (
    RENDER_MODES,
    open_window,
    take_picture,
)
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.scene import world
from drake_affetto.station.scenario import Scenario, load_scenario

REWARDS = ("sparse", "shaped")

_STEP = 0.05  # s, 20 Hz
# What an observation is in units of, and where it is clipped.
_PRESSURE = 1e5  # Pa
_HIGHEST_PRESSURE = 10.0
_FASTEST = 20.0  # rad/s
_BEYOND = 0.2  # rad, past a joint's limit: the stop is soft


class StrikeEnv(gymnasium.Env):
    """Strike the drum within the time of a movement (3 s, 60 steps).

    - Observation (4n + 3,): angles q (n), rad, speeds q̇ (n), rad/s, absolute
      pressures (2n), 10⁵ Pa, the task parameter τ (2), scaled as in `DrumEnv`,
      and the phase (1), which rises from 0 to 1.
    - Action (n,) in [-1, 1]: targets of the joints, from their lower to their
      upper limits. A target moves there evenly within the step, at most at
      `fastest`, and the PIDF controllers follow it.
    - Reward, sparse: R of the sound (paper Eq. 10) in the last step, else 0.
      Shaped: what brings the posture nearer to that of a lesson is paid too,
      γΦ(next) - Φ(now) (Ng, Harada and Russell, 1999) with γ = 1, where Φ is
      minus the root mean square, rad, of what q differs by from the lesson
      whose τ is nearest, at the same phase. Both are known to the robot: its
      own joints and what it was taught, never how far the drum is.
    - An episode ends with the time. `reset` takes `options={"xy": [x, y]}`.
    - `info` has `success` in the last step.
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 20}  # noqa: RUF012

    def __init__(
        self,
        scenario: str = "drumming",
        *,
        reward: str = "sparse",
        fastest: float = 3.0,
        lessons: int | str | Path = 16,
        render_mode: str | None = None,
    ):
        """Builds the station.

        Args:
            scenario: Scenario, by name or path.
            reward: "sparse" or "shaped".
            fastest: Greatest speed of a target, rad/s.
            lessons: Those that shape the reward, see `DrumEnv`.
            render_mode: "rgb_array" or "human", see `DrumEnv`.

        Raises:
            InputError: If an argument or the scenario does not fit.
        """
        require_choice("render_mode", render_mode, None, *RENDER_MODES)
        require_choice("reward", reward, *REWARDS)
        require_range("fastest", fastest, 1e-3, _FASTEST)
        self.render_mode = render_mode
        self._name = scenario
        self._scenario: Scenario = load_scenario(scenario)
        self._lessons = (
            load_lessons("drumming", lessons) if reward == "shaped" else None
        )
        self._runner = TrialRunner(
            dataclasses.replace(self._scenario, motion_source="external"),
            open_window() if render_mode == "human" else None,
        )
        self._station = self._runner.station
        self._station_context = self._station.GetMyMutableContextFromRoot(
            self._runner.context
        )
        self._steps = round(self._scenario.dmp.duration / _STEP)
        self._most = fastest * _STEP
        joints = [
            world.get_joint(self._station.plant, name)
            for name in self._station.joints.names
        ]
        self._low, self._high = (
            np.array(
                [
                    getattr(joint, f"position_{end}_limits")()[0]
                    for joint in joints
                ]
            )
            for end in ("lower", "upper")
        )
        n = self._station.num_joints
        self.observation_space = spaces.Box(
            _join(
                self._low - _BEYOND,
                [-_FASTEST] * n,
                [0.0] * 2 * n,
                -2.0,
                -2.0,
                0.0,
            ),
            _join(
                self._high + _BEYOND,
                [_FASTEST] * n,
                [_HIGHEST_PRESSURE] * 2 * n,
                2.0,
                2.0,
                1.0,
            ),
            dtype=np.float32,
        )
        self.action_space = spaces.Box(-1.0, 1.0, (n,), np.float32)
        self._step = self._steps
        self._tau = np.zeros(2, np.float32)
        self._lesson: Array | None = None
        self._begin = 0.0
        self._target = self._station.start_posture

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Puts the drum somewhere, looks at it and comes to rest.

        Args:
            options: None, or `{"xy": [x, y]}`, where the drum stands, m.

        Raises:
            InputError: If the drum cannot be seen there.
        """
        super().reset(seed=seed)
        # Another station looks: this one has no gaze.
        xy, tau, trial_seed = look_at_new_place(
            self._name, self._scenario, self.np_random, options, {}
        )
        self._tau = scaled_tau(self._scenario, tau)
        if self._lessons is not None:
            away = np.linalg.norm(self._lessons.tau - np.array(tau), axis=1)
            self._lesson = self._lessons.q[int(away.argmin())]
        self._target = self._station.start_posture
        self._command(self._target, 0.0 * self._target)
        self._begin = self._runner.settle(xy, trial_seed)
        self._step = 0
        return self._observe(), {}

    def step(
        self, action: np.ndarray
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Moves for 0.05 s.

        Args:
            action: Joint targets (n,), each entry in [-1, 1].

        Raises:
            InputError: If the action does not fit, or there was no reset.
        """
        action = require_array(
            "action", action, self.action_space.shape, low=-1.0, high=1.0
        )
        if self._step >= self._steps:
            raise InputError("the episode is over: call reset() before step()")
        before = self._potential()
        self._move(self._low + 0.5 * (action + 1.0) * (self._high - self._low))
        self._step += 1
        over = self._step == self._steps
        # The potential of an episode's end is 0: the sum of what shaping pays
        # depends on the beginning alone, so the best policy stays the best.
        reward = (0.0 if over else self._potential()) - before
        info = {}
        if over:
            heard = self._listen()
            reward += heard
            threshold = self._runner.reward_config.threshold
            info["success"] = bool(heard > threshold)
        return self._observe(), float(reward), over, False, info

    def render(self) -> Image | None:  # type: ignore[override]
        """The scene from outside as RGB; None in the other modes."""
        if self.render_mode != "rgb_array":
            return None
        return take_picture(self._station, self._runner.context)

    def _move(self, goal: Array) -> None:
        """Moves the targets towards a goal (n,), rad, for one step."""
        start = self._target
        way = np.clip(goal - start, -self._most, self._most)
        self._target = start + way
        ticks = round(_STEP / self._scenario.control.period)
        begin = self._begin + self._step * _STEP
        for tick in range(1, ticks + 1):
            self._command(start + way * tick / ticks, way / _STEP)
            self._runner.advance(begin + _STEP * tick / ticks)

    def _listen(self) -> float:
        """R of what was heard since the beginning."""
        self._command(self._target, 0.0 * self._target)
        seed = int(self.np_random.integers(2**31))
        recording = self._runner.finish_recording(self._begin, seed)
        return self._runner.reward(recording, self._runner.tap_prototypes())

    def _command(self, q: Array, v: Array) -> None:
        self._station.GetInputPort("affetto.desired_state").FixValue(
            self._station_context, np.concatenate([q, v])
        )

    def _potential(self) -> float:
        """Φ; 0 without lessons."""
        if self._lesson is None:
            return 0.0
        last = len(self._lesson) - 1
        q = self._lesson[round(last * self._step / self._steps)]
        away = self._state()[: len(q)] - q
        return -float(np.sqrt(np.mean(away**2)))

    def _state(self) -> Array:
        return self._runner.port("affetto.estimated_state")

    def _observe(self) -> np.ndarray:
        pressure = self._runner.port("affetto.chamber_pressure") / _PRESSURE
        phase = [self._step / self._steps]
        values = np.concatenate([self._state(), pressure, self._tau, phase])
        space = self.observation_space
        assert isinstance(space, spaces.Box)
        return np.clip(values.astype(np.float32), space.low, space.high)


def _join(*parts: Any) -> np.ndarray:
    """Numbers and vectors as one vector of float32."""
    return np.hstack(parts).astype(np.float32)
