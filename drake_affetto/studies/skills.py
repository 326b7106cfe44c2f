"""The skill and the schemes of transfer, as a scenario sets them up."""

from typing import Any

import numpy as np

from drake_affetto.scenario import SkillConfig
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.schemes import make_scheme


def make_skill(config: SkillConfig, seed: int) -> ElmRegressor:
    """An untrained parameterised skill (paper Eqs. 3 and 4)."""
    return ElmRegressor(
        n_hidden=config.n_hidden,
        alpha=config.alpha,
        weight_scale=config.weight_scale,
        input_range=config.input_range,
        random_state=seed,
    )


def fit_scheme(
    name: str,
    source: ElmRegressor,
    tau: np.ndarray,
    theta: np.ndarray,
    config: SkillConfig,
) -> Any:
    """One scheme of the paper's comparison, fitted to what is new.

    Args:
        name: one of `drake_affetto.skill.schemes.SCHEMES`.
        source: the skill as learned before; it is not changed.
        tau: (N, 2) task parameters in the new condition.
        theta: (N, F) demonstrated there.
        config: of a skill that is learned from scratch.

    Returns:
        A fitted regressor from τ̂ to θ.

    Raises:
        ValueError: for another name.
    """
    scheme = make_scheme(name, source, input_range=config.input_range)
    return scheme.fit(tau, theta)
