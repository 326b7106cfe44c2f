"""Speed of the learning core: DMP, ELM, transfer. See benchmark.py."""

from collections.abc import Callable
import time
from typing import Any
import warnings

import numpy as np

from drake_affetto.motion import Dmp
from drake_affetto.skill import ElmRegressor, TransferRegressor

_JOINTS = 8
_BASES = 15
_OUTPUTS = _JOINTS * _BASES


def _seconds(call: Callable[[], Any], tries: int = 7, repeats: int = 1):
    """The least CPU time of one call."""
    call()
    least = float("inf")
    for _ in range(tries):
        begin = time.process_time()
        for _ in range(repeats):
            call()
        least = min(least, (time.process_time() - begin) / repeats)
    return least


def _line(what: str, ours: float, theirs: float | None, limit: str) -> None:
    """One measurement: ours, the ratio to what it is compared with, aim."""
    ratio = "" if theirs is None else f"{theirs / ours:8.0f} × faster than"
    other = "" if theirs is None else f" {theirs * 1e3:.3g} ms"
    print(f"{what:<38}{ours * 1e6:10.1f} µs{ratio}{other}   ({limit})")


def _demonstration() -> tuple[np.ndarray, np.ndarray]:
    """3 s at 1 kHz: eight joints that go somewhere, wander, and return."""
    t = np.linspace(0.0, 3.0, 3001)
    s = t / 3.0
    reach = 10 * s**3 - 15 * s**4 + 6 * s**5
    q = [
        1.2 * s * (1 - s) * np.sin(2 * np.pi * s * (1 + 0.2 * j))
        + 0.2 * j * reach * (1 - s)
        for j in range(_JOINTS)
    ]
    return t, np.stack(q, axis=1)


def dmp() -> None:
    """Encoding and playing a movement, beside movement-primitives."""
    t, q = _demonstration()
    ours = Dmp()
    theta = ours.encode(t, q)
    played = ours.rollout(theta, q[0], 0.001)
    error = np.sqrt(np.mean((played.q - q) ** 2))

    their_encode = their_rollout = their_error = None
    try:
        from movement_primitives.dmp import DMP
    except ImportError as error:
        print(
            f"movement-primitives is not installed ({error}): no comparison; "
            "pip install movement-primitives pytransform3d"
        )
    else:
        theirs = DMP(_JOINTS, 3.0, 0.001, n_weights_per_dim=_BASES)
        their_encode = _seconds(lambda: theirs.imitate(t, q), tries=3)
        their_rollout = min(
            _seconds(lambda m=m: theirs.open_loop(step_function=m), tries=3)
            for m in ("rk4-cython", "euler-cython")
        )
        _, traced = theirs.open_loop()
        their_error = np.sqrt(np.mean((traced - q) ** 2))

    _line(
        "encode, times known from before",
        _seconds(lambda: ours.encode(t, q), repeats=20),
        their_encode,
        "wanted: 10 ×",
    )
    _line(
        "encode, first time with these times",
        _seconds(lambda: Dmp().encode(t, q)),
        their_encode,
        "once for a time grid",
    )
    _line(
        "rollout of q, q̇, q̈ at 1 kHz",
        _seconds(lambda: ours.rollout(theta, q[0], 0.001), repeats=20),
        their_rollout,
        "wanted: 100 ×; theirs: its fastest steps, q alone",
    )
    _line(
        "rollout, first time at this rate",
        _seconds(lambda: Dmp().rollout(theta, q[0], 0.001)),
        their_rollout,
        "once for a rate",
    )
    if their_error is not None:
        print(
            f"{'distance from the demonstration':<38}{error:10.2g} rad, "
            f"{their_error / error:.1f} × closer than {their_error:.2g} rad"
        )

    table = ours.step_table(0.005, 3.0)
    weights = ours.weights(theta)

    def stepwise() -> None:
        phase, state = 1.0, np.array([q[0], np.zeros(_JOINTS)])
        for _ in range(600):
            phase = ours.advance(phase, state, weights, q[0], table)

    _line("a step at 200 Hz", _seconds(stepwise) / 600, None, "wanted: 10 µs")


def _skill(random: np.random.Generator, n: int) -> tuple[np.ndarray, ...]:
    """Task parameters (n, 2) and policy parameters (n, 120) of a skill."""
    X = random.uniform(0.0, 1.0, (n, 2))
    mix = random.normal(size=(3, 2, 40)) * 1.5
    y = np.concatenate(
        [np.sin(X @ mix[0]), np.cos(X @ mix[1]), X @ mix[2]], axis=1
    )
    return X, y * random.uniform(1.0, 30.0, _OUTPUTS)


def elm() -> None:
    """Learning one sample, H = 50, F = 120."""
    random = np.random.default_rng(0)
    X, y = _skill(random, 200)
    skill = ElmRegressor(input_range=[0.0, 1.0], random_state=0).fit(X, y)
    one, target = X[:1], y[:1]
    phi = skill.hidden(one)
    checked = _seconds(lambda: skill.partial_fit(one, target), repeats=200)
    _line("partial_fit of one sample", checked, None, "wanted: 300 µs")
    kernel = _seconds(lambda: skill._absorb(phi, target), repeats=200)
    _line("of that the update", kernel, None, "wanted: 60 µs")
    solve = _seconds(skill._solve, repeats=200)
    _line("read-out, when next needed", solve, None, "once for all updates")


def transfer() -> None:
    """A transfer from 5 samples, F = 120, H = 50, 32 starts."""
    from scipy.optimize import minimize

    random = np.random.default_rng(0)
    X, y = _skill(random, 60)
    skill = ElmRegressor(input_range=[0.0, 1.0], random_state=0).fit(X, y)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    tasks = random.uniform(0.0, 1.0, (5, 2))
    X_new = (tasks - 0.3) @ turn.T
    y_new = skill.predict(tasks)
    y_new += 0.1 * random.normal(size=y_new.shape)
    ours = TransferRegressor(skill, prior=None, metric=None, average=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ours.fit(X_new, y_new)

    # The same starts and cost, as one would write it down.
    weights, biases, coef = skill.input_weights_, skill.biases_, skill.coef_

    def cost(p: np.ndarray) -> float:
        moved = X_new @ p[:4].reshape(2, 2).T + p[4:]
        scaled = (moved - skill.input_center_) * skill.input_gain_
        phi = 1.0 / (1.0 + np.exp(-(scaled @ weights + biases)))
        return np.sum((phi @ coef - y_new) ** 2) + 0.03 * np.sum(p**2)

    begin = time.process_time()
    found = [minimize(cost, s.initial, method="BFGS") for s in ours.starts_]
    plain = time.process_time() - begin
    for name, estimator in (
        ("transfer, 32 starts, Eq. 5", ours),
        ("transfer, 32 starts, default", TransferRegressor(skill)),
    ):
        fit = _seconds(lambda e=estimator: e.fit(X_new, y_new))
        _line(name, fit, plain, "wanted: 50 ×, 50 ms")
    best = min(f.fun for f in found)
    print(f"{'least cost':<38}{ours.cost_:10.6g}, by BFGS {best:.6g}")
