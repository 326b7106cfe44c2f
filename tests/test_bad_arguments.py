"""What the mathematics is handed is refused by name where it cannot be.

Each function of the table is called with one argument spoiled at a time: not a
number, infinite, a word, of another shape, out of its range. Loops that run in
every step (`Dmp.advance`, `pidf_update`, `step_joints`) are not in it: what
they take has been checked where it came in.
"""

from collections.abc import Callable
import dataclasses
from typing import Any

import numpy as np
import pytest

from drake_affetto.control.pidf import PidfGains
from drake_affetto.geometry.kinematics import SerialChain, solve_position
from drake_affetto.geometry.optics import FisheyeCamera, PinholeCamera
from drake_affetto.geometry.region import grid_inside, spread_inside
from drake_affetto.motion.dmp import Dmp
from drake_affetto.motion.dmp_config import DmpConfig
from drake_affetto.perception.blob import BlobConfig, calibrate, detect
from drake_affetto.pneumatics.equilibrium import (
    opening_for_torque,
    pressures_for_torque,
)
from drake_affetto.pneumatics.flow import mass_flow_rate
from drake_affetto.pneumatics.parameters import (
    chamber_volumes,
    closed_stiffness,
    load_parameters,
    parameter_array,
)
from drake_affetto.sensing.readings import SensorParameters
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import Domain
from drake_affetto.skill.residuals import loo_covariance, whitening
from drake_affetto.sound.impact import contact_force, stroke
from drake_affetto.sound.reward import (
    cut_prototype,
    reward,
    reward_over_time,
    similarity,
    spectrogram,
)
from drake_affetto.sound.wav import write_wav


@dataclasses.dataclass(frozen=True)
class Case:
    """A function, arguments that it takes, and which of them are spoiled.

    Attributes:
        call: the function.
        good: arguments by name.
        arrays: names of arrays.
        numbers: names of numbers, each with values that it cannot have.
    """

    call: Callable[..., Any]
    good: dict[str, Any]
    arrays: tuple[str, ...] = ()
    numbers: dict[str, tuple[Any, ...]] = dataclasses.field(
        default_factory=dict
    )


PARAMETERS = load_parameters().for_joints(
    ["waist_yaw", "waist_roll"], [-0.5, -0.3], [0.5, 0.3]
)
SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
CHAIN = {
    "names": ("a", "b", "c"),
    "X_PJ": np.array([np.eye(4)] * 3),
    "axes": np.eye(3),
    "X_JT": np.eye(4) + np.diag([0.3] * 3, 1),
    "lower": -np.ones(3),
    "upper": np.ones(3),
}
SOUND = np.random.default_rng(0).normal(size=(6, 20)) ** 2
SAMPLES = np.random.default_rng(0).uniform(size=(9, 2))
ELM = ElmRegressor(n_hidden=4, random_state=0).fit(SAMPLES, SAMPLES)
DMP = Dmp(DmpConfig())
T = np.linspace(0.0, 1.0, 40)
THETA = np.ones(2 * DMP.n_basis)
POSITIVE = (0.0, -1.0)

CASES = {
    "spectrogram": Case(
        spectrogram,
        {"pressure": np.zeros(8000), "rate": 8000.0},
        ("pressure",),
        {"rate": POSITIVE},
    ),
    "similarity": Case(similarity, {"s": SOUND, "p": SOUND[:, :5]}, ("s", "p")),
    "reward": Case(
        reward,
        {"recording": SOUND, "prototypes": [SOUND[:, :5]]},
        ("recording", "prototypes"),
    ),
    "reward_over_time": Case(
        reward_over_time,
        {"recording": SOUND, "prototypes": [SOUND[:, :5]]},
        ("recording", "prototypes"),
    ),
    "cut_prototype": Case(cut_prototype, {"recording": SOUND}, ("recording",)),
    "contact_force": Case(
        contact_force, {"t": T, "target": 0.01 - 0.02 * T}, ("t", "target")
    ),
    "stroke": Case(
        stroke,
        {
            "t": T,
            "start": 0.0,
            "height": 0.1,
            "depth": 0.01,
            "fall": 0.3,
            "dwell": 0.0,
            "rise": 0.3,
        },
        (),
        {
            "start": (),
            "height": (),
            "depth": (),
            "fall": POSITIVE,
            "dwell": (-1.0,),
            "rise": POSITIVE,
        },
    ),
    "write_wav": Case(
        write_wav,
        {"path": "/dev/null", "pressure": T, "rate": 8000.0},
        ("pressure",),
        {"rate": POSITIVE},
    ),
    "mass_flow_rate": Case(
        mass_flow_rate,
        {"p_up": 5e5, "p_down": 1e5, "C": 1e-8, "b": 0.3, "T": 293.0},
        (),
        {
            "p_up": (-1.0,),
            "p_down": (-1.0,),
            "C": (-1.0,),
            "b": (-0.1, 1.0),
            "T": POSITIVE,
        },
    ),
    "pressures_for_torque": Case(
        pressures_for_torque,
        {"parameters": PARAMETERS, "torque": [0.1, 0.2], "mean": 3e5},
        ("torque", "mean"),
    ),
    "opening_for_torque": Case(
        opening_for_torque,
        {"parameters": PARAMETERS, "torque": [0.1, 0.2]},
        ("torque",),
    ),
    "chamber_volumes": Case(
        chamber_volumes, {"parameters": PARAMETERS, "q": [0.0, 0.1]}, ("q",)
    ),
    "closed_stiffness": Case(
        closed_stiffness,
        {"parameters": PARAMETERS, "q": [0.0, 0.1], "pressure": [2e5] * 4},
        ("q", "pressure"),
    ),
    "parameter_array": Case(
        parameter_array, {"parameters": np.array([[np.nan]])}, ()
    ),
    "PidfGains": Case(
        PidfGains,
        {name: [1.0, 2.0] for name in ("kP", "kI", "kD", "kF")},
        ("kP", "kI", "kD", "kF"),
    ),
    "PidfGains.from_array": Case(
        PidfGains.from_array, {"array": np.ones((4, 2))}, ()
    ),
    "PinholeCamera.from_fov": Case(
        PinholeCamera.from_fov,
        {"width": 320, "height": 240, "fov_y": 0.8},
        (),
        {"width": POSITIVE, "height": POSITIVE, "fov_y": (*POSITIVE, 3.2)},
    ),
    "FisheyeCamera.from_fov": Case(
        FisheyeCamera.from_fov,
        {"width": 320, "height": 240, "fov_y": 0.8, "k1": 0.1, "k2": 0.0},
        (),
        {
            "width": POSITIVE,
            "height": POSITIVE,
            "fov_y": POSITIVE,
            "k1": (),
            "k2": (),
        },
    ),
    "SerialChain": Case(SerialChain, CHAIN, ("X_PJ", "axes", "X_JT")),
    "SerialChain.pose": Case(SerialChain(**CHAIN).pose, {"q": np.zeros(3)}, ()),
    "solve_position": Case(
        solve_position,
        {
            "chain": SerialChain(**CHAIN),
            "targets": np.zeros((1, 3)),
            "rest": np.zeros(3),
            "weights": np.ones(3),
            "margin": 0.0,
            "damping": 0.01,
            "comfort": 0.05,
            "iterations": 2,
        },
        ("targets", "rest", "weights"),
        {
            "margin": (-0.1, 1.0),
            "damping": POSITIVE,
            "comfort": (-0.1, 1.1),
            "iterations": POSITIVE,
        },
    ),
    "grid_inside": Case(
        grid_inside, {"corners": SQUARE, "n": 3}, ("corners",), {"n": (1, -1)}
    ),
    "spread_inside": Case(
        spread_inside,
        {"corners": SQUARE, "count": 3, "rng": np.random.default_rng(0)},
        ("corners",),
        {"count": (-1,)},
    ),
    "calibrate": Case(
        calibrate, {"uv": 9 * SAMPLES, "margin": 0.05}, (), {"margin": (-0.1,)}
    ),
    "detect": Case(
        detect,
        {"image": np.zeros((9, 9, 3), np.uint8), "config": BlobConfig()},
        ("image",),
    ),
    "SensorParameters.scales": Case(
        SensorParameters().scales,
        {"names": ["a"], "q_lower": [0.0], "q_upper": [1.0]},
        (),
    ),
    "Domain.of_range": Case(
        Domain.of_range, {"limits": [[0.0, 1.0]]}, ("limits",)
    ),
    "Domain.of_samples": Case(Domain.of_samples, {"X": SAMPLES}, ("X",)),
    "loo_covariance": Case(
        loo_covariance,
        {"estimator": ELM, "X": SAMPLES, "y": SAMPLES, "shrinkage": 0.5},
        ("X", "y"),
        {"shrinkage": (-0.1, 1.1)},
    ),
    "whitening": Case(
        whitening, {"metric": np.eye(2), "n_out": 2}, ("metric",)
    ),
    "Dmp.basis": Case(DMP.basis, {"phase": [0.5]}, ()),
    "Dmp.weights": Case(DMP.weights, {"theta": THETA}, ("theta",)),
    "Dmp.rollout": Case(
        DMP.rollout,
        {"theta": THETA, "q0": [0.0, 0.0], "dt": 0.01, "duration": 1.0},
        ("theta", "q0"),
        {"dt": POSITIVE, "duration": POSITIVE},
    ),
    "Dmp.step": Case(
        DMP.step,
        {
            "phase": 1.0,
            "q": [0.0, 0.0],
            "q_dot": [0.0, 0.0],
            "theta": THETA,
            "goal": [0.0, 0.0],
            "dt": 0.01,
        },
        ("q", "q_dot", "theta", "goal"),
        {"phase": (-0.1, 1.1), "dt": POSITIVE},
    ),
    "Dmp.step_table": Case(
        DMP.step_table,
        {"dt": 0.01, "duration": 1.0},
        (),
        {"dt": POSITIVE, "duration": POSITIVE},
    ),
    "Dmp.encode": Case(
        DMP.encode,
        {"t": T, "q": np.stack([T, T**2], axis=1)},
        ("t", "q"),
    ),
}

# Good arguments of these are spoiled already, or only their numbers count.
_NOT_GOOD = {"parameter_array"}


def spoiled_arrays(value: Any) -> dict[str, Any]:
    """An array with one entry that is none, and others that do not fit."""
    spoiled: dict[str, Any] = {}
    if isinstance(value, list) and isinstance(value[0], np.ndarray):
        for name, each in spoiled_arrays(value[0]).items():
            spoiled[name] = [each]
        return spoiled
    array = np.array(value)
    for name, entry in (("nan", np.nan), ("inf", np.inf)):
        if array.dtype != np.uint8:
            changed = np.array(array, dtype=float)
            changed.flat[changed.size // 2] = entry
            spoiled[name] = changed
    spoiled["deeper"] = np.array([[array]])
    spoiled["words"] = "many"
    return spoiled


def spoiled_numbers(values: tuple[Any, ...]) -> dict[str, Any]:
    """What is no finite number, and what is out of range."""
    both = (np.nan, np.inf, -np.inf, *values)
    return {"word": "many", **{repr(value): value for value in both}}


def calls() -> list[Any]:
    found = []
    for name, case in CASES.items():
        if name == "parameter_array":
            found.append(pytest.param(name, "parameters", None, id=name))
            continue
        for argument in case.arrays:
            for kind, value in spoiled_arrays(case.good[argument]).items():
                found.append(
                    pytest.param(
                        name, argument, value, id=f"{name}-{argument}-{kind}"
                    )
                )
        for argument, values in case.numbers.items():
            for kind, value in spoiled_numbers(values).items():
                found.append(
                    pytest.param(
                        name, argument, value, id=f"{name}-{argument}-{kind}"
                    )
                )
    return found


@pytest.mark.parametrize("name", sorted(set(CASES) - _NOT_GOOD))
def test_the_good_arguments_are_taken(name):
    case = CASES[name]
    case.call(**case.good)


@pytest.mark.parametrize(("name", "argument", "value"), calls())
def test_a_spoiled_argument_is_named(name, argument, value):
    case = CASES[name]
    given = case.good if value is None else {**case.good, argument: value}
    with pytest.raises(ValueError) as caught:
        case.call(**given)
    told = str(caught.value)
    assert argument in told or f"[{argument}" in told
    assert "\n" not in told


@pytest.mark.parametrize(
    ("name", "argument", "value"),
    [
        ("SerialChain.pose", "q", np.zeros(2)),
        ("SerialChain.pose", "q", np.zeros((5, 4))),
        ("SerialChain", "lower", np.zeros(2)),
        ("SerialChain", "upper", np.array([1.0, np.nan, 1.0])),
        ("PidfGains.from_array", "array", np.ones((3, 2))),
        ("PidfGains.from_array", "array", np.full((4, 2), np.nan)),
        ("calibrate", "uv", np.zeros(4)),
        ("calibrate", "uv", np.zeros((4, 3))),
        ("SensorParameters.scales", "q_upper", [-1.0]),
        ("contact_force", "t", T**2),
        ("contact_force", "t", T[::-1]),
        ("spread_inside", "corners", [[0, 0], [1, 1], [2, 2]]),
        ("Domain.of_range", "limits", [[1.0, 0.0]]),
        ("Dmp.basis", "phase", [np.nan]),
        ("stroke", "t", [np.nan]),
    ],
)
def test_what_has_another_shape_or_order_is_refused(name, argument, value):
    case = CASES[name]
    told = "limits" if argument == "q_upper" else argument
    with pytest.raises(ValueError, match=told):
        case.call(**{**case.good, argument: value})
