"""The skill and the schemes of transfer, as a scenario sets them up."""

from collections.abc import Iterable, Mapping, Sequence
import copy
import functools
from typing import TYPE_CHECKING, Any
import warnings

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.results import (
    DemonstrationResult,
    GazeResult,
    StrikeResult,
)
from drake_affetto.experiments.trials import (
    demonstration,
    draw_positions,
    look,
    run_trials,
    strike,
    trial_seed,
)
from drake_affetto.geometry.region import grid_inside
from drake_affetto.runner.executor import Key, Spec, TrialExecutor
from drake_affetto.station.content import Content, scenario_content
from drake_affetto.station.scenario import (
    Scenario,
    SkillConfig,
    TransferConfig,
    load_scenario,
)

if TYPE_CHECKING:
    from drake_affetto.perception.optical_map import OpticalMap
    from drake_affetto.skill.elm import ElmRegressor
    from drake_affetto.skill.mappings import Mapping as MapFamily

# scikit-learn is imported where it is used: the first trials need not wait for
# it.

# The least that a skill can be learned from.
_FEWEST = 3

# Of the seeds of strikes that are repeated.
_AGAIN = 0xA6A1

# A palm still sounds a drum of 8 cm from about so far beside its center, m;
# and points along the region's box by which the best constant is chosen.
_CHANCE_REACH = 0.05
_CHANCE_GRID = 41


def make_skill(config: SkillConfig, seed: int) -> "ElmRegressor":
    """An untrained parameterized skill (paper Eqs. 3 and 4)."""
    from drake_affetto.skill.elm import ElmRegressor

    return ElmRegressor(
        n_hidden=config.n_hidden,
        alpha=config.alpha,
        weight_scale=config.weight_scale,
        input_range=config.input_range,
        random_state=seed,
    )


def successful(
    demonstrations: Iterable[DemonstrationResult],
) -> list[DemonstrationResult]:
    """Those demonstrations whose replay made the drum sound."""
    return [each for each in demonstrations if each.success]


def learn_skill(
    config: SkillConfig,
    demonstrations: Sequence[DemonstrationResult],
    seed: int,
) -> "ElmRegressor":
    """The skill after all demonstrations (paper Eqs. 3 and 4).

    Args:
        config: Configuration of the skill.
        demonstrations: Successful demonstrations, learned one by one.
        seed: Seed of the hidden layer.

    Raises:
        InputError: If there are too few of them.
    """
    if len(demonstrations) < _FEWEST:
        raise InputError(
            f"only {len(demonstrations)} demonstrations made the drum sound; "
            f"a skill needs {_FEWEST}"
        )
    return skills_by_count(config, demonstrations, seed)[-1]


def skills_by_count(
    config: SkillConfig,
    demonstrations: Sequence[DemonstrationResult],
    seed: int,
) -> "list[ElmRegressor]":
    """The skill after each of the demonstrations, in order."""
    skill = make_skill(config, seed)
    skills = []
    for each in demonstrations:
        skill.partial_fit([each.tau], [each.theta])
        skills.append(copy.deepcopy(skill))
    return skills


def stack_prototypes(
    demonstrations: Sequence[DemonstrationResult],
) -> np.ndarray:
    """(N, bands, frames), the sounds of the demonstrations' replays."""
    return np.stack([each.prototype for each in demonstrations])


def task_parameters(
    demonstrations: Sequence[DemonstrationResult],
) -> np.ndarray:
    """(N, 2), where the drum was seen at the demonstrations."""
    return np.array([each.tau for each in demonstrations])


def teach_positions(
    executor: TrialExecutor,
    label: str,
    scenario: str,
    count: int,
    seed: Sequence[int],
    *,
    variability: float = 1.0,
    workspace: float = 1.0,
) -> list[DemonstrationResult]:
    """Has demonstrations given at `count` positions of the drum.

    Each is repeated until the drum sounds. A position at which the teacher
    fails every time is replaced by another one.

    Args:
        executor: Executor of the study.
        label: Name of this phase of the study.
        scenario: Scenario, by name or path.
        count: Number of demonstrations.
        seed: Seed of the positions and the teacher, as several numbers.
        variability: Factor of the teacher's variation, see `demonstration`.
        workspace: Share of the drum's region, see `draw_positions`.

    Returns:
        The demonstrations, all successful.

    Raises:
        InputError: If two of three positions fail.
    """
    rng = np.random.default_rng([*seed, 0])
    loaded = load_scenario(scenario)
    positions = np.vstack(
        [
            draw_positions(loaded, number, rng, workspace)
            for number in (count, 2 * count)
        ]
    )
    results: list[DemonstrationResult] = []
    while (missing := count - len(successful(results))) > 0:
        if len(results) >= len(positions):
            raise InputError(
                f"{label}: only {count - missing} of {len(results)} "
                "demonstrations made the drum sound"
            )
        now = range(len(results), min(len(results) + missing, len(positions)))
        results += run_trials(
            executor,
            label if not results else f"{label}, further positions",
            {
                i: demonstration(
                    scenario, positions[i], trial_seed(*seed, 1, i), variability
                )
                for i in now
            },
        ).values()
    return successful(results)[:count]


def look_at_positions(
    executor: TrialExecutor,
    label: str,
    scenarios: Sequence[str],
    positions: Sequence[np.ndarray],
    seed: Sequence[int],
) -> dict[tuple[int, int], GazeResult]:
    """Has the gaze search for the drum at the test positions of all repeats.

    Args:
        executor: Executor of the study.
        label: Name of this phase of the study.
        scenarios: Scenario of each repeat, by name or path.
        positions: Test positions of each repeat, (count, 2) each, m.
        seed: Seed of the noise, as several numbers.

    Returns:
        The results by repeat and number of the position.
    """
    return run_trials(
        executor,
        label,
        {
            (repeat, i): look(scenario, xy, trial_seed(*seed, repeat, i))
            for repeat, (scenario, each) in enumerate(
                zip(scenarios, positions, strict=True)
            )
            for i, xy in enumerate(each)
        },
    )


def strike_if_seen(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    gaze: GazeResult,
    skill: Any,
    prototypes: np.ndarray,
) -> Spec | None:
    """The spec of a strike as a skill makes it; None without a drum in sight.

    Args:
        scenario: Scenario, by name or path.
        xy: Position of the drum (2,), m.
        seed: Seed of the trial; that of the look.
        gaze: What the gaze found there.
        skill: Fitted regressor from τ to θ.
        prototypes: Prototypes of the reward (N, bands, frames).
    """
    if not gaze.found:
        return None
    return strike(scenario, xy, seed, skill.predict([gaze.tau])[0], prototypes)


def run_strikes(
    executor: TrialExecutor,
    label: str,
    tests: Mapping[Key, Spec | None],
    repeat_invalid: int = 0,
) -> dict[Key, StrikeResult | None]:
    """Runs the strikes of a study; None stays None.

    Args:
        executor: Executor of the study.
        label: Name of this phase of the study.
        tests: Specs of `strike_if_seen`, by key.
        repeat_invalid: How often a strike that the supervisor does not pass is
            repeated, each time with another seed. What is not valid even then
            keeps its reason: it is to be counted apart.
    """
    planned = {test: spec for test, spec in tests.items() if spec is not None}
    strikes: dict[Key, StrikeResult] = run_trials(executor, label, planned)
    for again in range(1, repeat_invalid + 1):
        invalid = {
            test: {
                **planned[test],
                "seed": trial_seed(planned[test]["seed"], _AGAIN, again),
            }
            for test, strike in strikes.items()
            if strike.invalid
        }
        if not invalid:
            break
        strikes |= run_trials(
            executor, f"{label}, not valid before, {again}", invalid
        )
    return {test: strikes.get(test) for test in tests}


def best_constant(
    demonstrations: Sequence[DemonstrationResult], scenario: Scenario
) -> np.ndarray:
    """The demonstrated movement (F,) that suits most places of the drum.

    Played blind it is the chance level: what is reached by a robot that has
    learned nothing of where the drum is. It is chosen by the true places, so
    chance is not taken to be smaller than it is.

    Args:
        demonstrations: Successful demonstrations.
        scenario: Scenario with the drum's region.
    """
    places = grid_inside(scenario.drum_region.corners, _CHANCE_GRID)
    taught = np.array([each.xy for each in demonstrations])
    away = np.linalg.norm(places[:, None] - taught, axis=-1)
    served = (away < _CHANCE_REACH).sum(axis=0)
    return demonstrations[int(np.argmax(served))].theta


def fit_scheme(
    name: str,
    source: "ElmRegressor",
    tau: np.ndarray,
    theta: np.ndarray,
    scenario: str,
    direct: str,
    seed: int = 0,
    loaded: Scenario | None = None,
) -> Any:
    """One scheme of the paper's comparison, fitted to what is new.

    Args:
        name: one of `drake_affetto.skill.schemes.SCHEMES`.
        source: the skill as learned before; it is not changed.
        tau: (N, 2) task parameters in the new condition.
        theta: (N, F) demonstrated there.
        scenario: of the new condition, by name or path.
        direct: in which the skill was learned, by name or path.
        seed: of the errors with which the optical map knows the camera.
        loaded: the scenario of the new condition, if it is loaded already.

    Returns:
        A fitted regressor from τ̂ to θ.

    Raises:
        ValueError: for another name.
    """
    loaded = loaded or load_scenario(scenario)
    parameters: dict[str, Any] = {}
    if name == "transfer_default":
        parameters = {
            "mapping": _mapping(loaded.transfer, scenario, direct, seed),
            "residual": "smooth" if loaded.transfer.residual else None,
        }
    return fit_with(name, source, tau, theta, loaded.skill, **parameters)


def fit_with(
    name: str,
    source: "ElmRegressor",
    tau: np.ndarray,
    theta: np.ndarray,
    config: SkillConfig,
    **parameters: Any,
) -> Any:
    """A scheme with these parameters, fitted to what is new.

    Args:
        name: one of `drake_affetto.skill.schemes.SCHEMES`.
        source: the skill as learned before; it is not changed.
        tau: (N, 2) task parameters in the new condition.
        theta: (N, F) demonstrated there.
        config: of a skill in the new condition.
        parameters: of the scheme, as its `set_params` takes them.

    Returns:
        A fitted regressor from τ̂ to θ.

    Raises:
        ValueError: for another name.
    """
    from drake_affetto.skill.schemes import make_scheme

    scheme = make_scheme(name, source, input_range=config.input_range)
    scheme.set_params(**parameters)
    with warnings.catch_warnings():
        # That few samples do not determine the map is what is studied.
        warnings.simplefilter("ignore", UserWarning)
        return scheme.fit(tau, theta)


def _mapping(
    transfer: TransferConfig, scenario: str, direct: str, seed: int
) -> "str | MapFamily":
    """The family of maps that a scenario names."""
    if transfer.mapping != "optical":
        return transfer.mapping
    from drake_affetto.experiments.view_maps import with_wrong_camera
    from drake_affetto.skill.optical import OpticalMapping

    exact = _optical_map(
        scenario,
        direct,
        (scenario_content(scenario), scenario_content(direct)),
    )
    believed = with_wrong_camera(
        exact, transfer.errors, np.random.default_rng(seed)
    )
    return OpticalMapping(**vars(believed) | {"plane": transfer.plane})


@functools.cache
def _optical_map(
    scenario: str, direct: str, _: tuple[Content, Content]
) -> "OpticalMap":
    """The optical map between scenarios of that content, all known exactly."""
    from drake_affetto.experiments.view_maps import (
        ViewDomain,
        make_optical_map,
    )

    return make_optical_map(ViewDomain.of(scenario), ViewDomain.of(direct))
