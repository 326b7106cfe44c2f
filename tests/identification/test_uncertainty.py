"""The uncertainty of a fit, on synthetic logs."""

import dataclasses

import numpy as np

from drake_affetto.identification.fit import FitState
from drake_affetto.identification.simulator import JointSimulator
from drake_affetto.identification.uncertainty import (
    estimate_uncertainty,
    profile_fit,
)


def test_uncertainty_knows_what_a_log_does_not_show(problem, truth, log):
    delay = JointSimulator(problem).estimate_start_delay(truth, log)
    noisy = dataclasses.replace(
        log, q=log.q + 0.3 * np.random.default_rng(0).normal(size=log.q.size)
    )
    state = FitState(values=dict(truth), start_delays={log.name: delay})
    found = estimate_uncertainty(problem, [noisy], state)
    assert found.determined["viscous_friction"]
    assert 0.0 < found.std["viscous_friction"] < truth["viscous_friction"]
    # The lower stop does not matter to a joint that never touches it after
    # the start; a long way before the dwell fades is no more than a guess.
    worst = max(found.std, key=lambda k: found.std[k] / abs(truth[k] or 1.0))
    assert found.std[worst] > 0.2 * abs(truth[worst] or 1.0)


def test_profile_refits_all_others(problem, truth, log, monkeypatch):
    monkeypatch.setattr(
        "drake_affetto.identification.uncertainty.PROFILED",
        ("viscous_friction",),
    )
    noisy = dataclasses.replace(
        log, q=log.q + 0.3 * np.random.default_rng(0).normal(size=log.q.size)
    )
    state = FitState(values=dict(truth), start_delays={log.name: 0.09})
    profiled = profile_fit(problem, [noisy], state)
    half, double = profiled.profile["viscous_friction"]
    assert half > 1.05
    assert double > 1.05
    # Profiled once, it is not done again.
    assert profile_fit(problem, [noisy], profiled) == profiled
