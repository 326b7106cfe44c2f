"""The skill and the schemes of transfer, as a scenario sets them up."""

from collections.abc import Iterable, Sequence
import functools
from typing import Any

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.trials import (
    demonstration,
    draw_positions,
    trial_seed,
)
from drake_affetto.runner.executor import Result, TrialExecutor
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import Mapping
from drake_affetto.skill.schemes import make_scheme
from drake_affetto.station.scenario import SkillConfig, load_scenario

# The least that a skill can be learned from.
_FEWEST = 3


def make_skill(config: SkillConfig, seed: int) -> ElmRegressor:
    """An untrained parameterised skill (paper Eqs. 3 and 4)."""
    return ElmRegressor(
        n_hidden=config.n_hidden,
        alpha=config.alpha,
        weight_scale=config.weight_scale,
        input_range=config.input_range,
        random_state=seed,
    )


def successful(lessons: Iterable[Result]) -> list[Result]:
    """Those demonstrations whose replay made the drum sound."""
    return [lesson for lesson in lessons if lesson[0]["success"]]


def learn_skill(
    config: SkillConfig, lessons: Sequence[Result], seed: int
) -> ElmRegressor:
    """The skill after the demonstrations, one by one (paper Eqs. 3 and 4).

    Args:
        lessons: results of `demonstration` trials, all successful.
        seed: of the hidden layer.

    Raises:
        InputError: if there are too few of them.
    """
    if len(lessons) < _FEWEST:
        raise InputError(
            f"only {len(lessons)} demonstrations made the drum sound; a skill "
            f"needs {_FEWEST}"
        )
    skill = make_skill(config, seed)
    for result, arrays in lessons:
        skill.partial_fit([result["tau"]], [arrays["theta"]])
    return skill


def stack_prototypes(lessons: Sequence[Result]) -> np.ndarray:
    """(N, bands, frames), what the demonstrations' replays sounded like."""
    return np.stack([arrays["prototype"] for _, arrays in lessons])


def teach_places(
    executor: TrialExecutor,
    label: str,
    scenario: str,
    count: int,
    seed: Sequence[int],
    *,
    variability: float = 1.0,
    workspace: float = 1.0,
) -> list[Result]:
    """Has `count` places taught, each until the drum sounds.

    A place where the teacher fails however often is given up for another.

    Args:
        label: of the stage.
        scenario: by name or path.
        seed: of the places and the teacher, numbers.
        variability: of the teacher, see `demonstration`.
        workspace: share of the drum's region, see `draw_positions`.

    Returns:
        Results of `demonstration` trials, all successful.

    Raises:
        InputError: if two of three places fail.
    """
    rng = np.random.default_rng([*seed, 0])
    loaded = load_scenario(scenario)
    places = np.vstack(
        [
            draw_positions(loaded, number, rng, workspace)
            for number in (count, 2 * count)
        ]
    )
    results: list[Result] = []
    while (missing := count - len(successful(results))) > 0:
        if len(results) >= len(places):
            raise InputError(
                f"{label}: only {count - missing} of {len(results)} "
                "demonstrations made the drum sound"
            )
        now = range(len(results), min(len(results) + missing, len(places)))
        results += executor.run(
            label if not results else f"{label}, further places",
            {
                i: demonstration(
                    scenario, places[i], trial_seed(*seed, 1, i), variability
                )
                for i in now
            },
        ).values()
    return successful(results)[:count]


def fit_scheme(
    name: str,
    source: ElmRegressor,
    tau: np.ndarray,
    theta: np.ndarray,
    scenario: str,
) -> Any:
    """One scheme of the paper's comparison, fitted to what is new.

    Args:
        name: one of `drake_affetto.skill.schemes.SCHEMES`.
        source: the skill as learned before; it is not changed.
        tau: (N, 2) task parameters in the new condition.
        theta: (N, F) demonstrated there.
        scenario: of the new condition, by name or path.

    Returns:
        A fitted regressor from τ̂ to θ.

    Raises:
        ValueError: for another name.
    """
    loaded = load_scenario(scenario)
    scheme = make_scheme(name, source, input_range=loaded.skill.input_range)
    if name == "transfer_default":
        scheme.set_params(
            mapping=_mapping(scenario, loaded.transfer.mapping),
            residual="smooth" if loaded.transfer.residual else None,
        )
    return scheme.fit(tau, theta)


@functools.cache
def _mapping(scenario: str, name: str) -> str | Mapping:
    """The family of maps that a scenario names."""
    if name != "optical":
        return name
    from drake_affetto.experiments.view_maps import (
        REFERENCE,
        View,
        make_optical_map,
    )
    from drake_affetto.skill.optical import OpticalMapping

    optical = make_optical_map(View.of(scenario), View.of(REFERENCE))
    return OpticalMapping(**vars(optical))
