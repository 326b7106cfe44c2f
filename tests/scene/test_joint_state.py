"""Angles and speeds of one and the same time."""

import numpy as np
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.scene.joint_state import make_joint_state
from drake_affetto.scene.joints import JointSelection

H = 0.0025


@pytest.fixture
def selection():
    """Joints 2 and 0 of three, in this order."""
    n, size = 2, 3
    state = np.zeros((2 * n, 2 * size))
    state[0, 2] = state[1, 0] = state[2, 5] = state[3, 3] = 1.0
    return JointSelection(
        model_instance=ModelInstanceIndex(2),
        names=("b", "a"),
        lower=np.full(n, -1.0),
        upper=np.full(n, 1.0),
        positions=np.array([2, 0]),
        velocities=np.array([2, 0]),
        actuators=np.array([2, 0]),
        state_matrix=state,
        actuation_matrix=np.zeros((size, n)),
    )


def test_the_robot_at_rest_is_at_rest(selection):
    dut = make_joint_state(selection, H)
    context = dut.CreateDefaultContext()
    state = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0])
    dut.get_input_port().FixValue(context, state)
    found = dut.get_output_port().Eval(context)
    np.testing.assert_allclose(found, [0.3, 0.1, 0.0, 0.0])


def test_speeds_belong_to_the_time_of_the_angles(selection):
    """A plant's step, q' = v', on an accelerated motion with known speeds."""

    def angle(t):
        return np.array([np.sin(5 * t), 0.0, t**2])

    def speed(t):
        return np.array([5 * np.cos(5 * t), 0.0, 2 * t])

    dut = make_joint_state(selection, H)
    context = dut.CreateDefaultContext()
    simulator = Simulator(dut, context)
    plain, better = [], []
    for k in range(1, 200):
        t = k * H
        mean = (angle(t) - angle(t - H)) / H
        dut.get_input_port().FixValue(context, np.concatenate([angle(t), mean]))
        found = dut.get_output_port().Eval(context)
        np.testing.assert_allclose(found[:2], angle(t)[[2, 0]])
        if k > 1:
            plain.append(np.abs(mean - speed(t))[[2, 0]])
            better.append(np.abs(found[2:] - speed(t)[[2, 0]]))
        simulator.AdvanceTo(t)
    # Constant acceleration: exact. Otherwise of the second order.
    np.testing.assert_allclose(np.array(better)[:, 0], 0.0, atol=1e-9)
    assert np.max(plain) > 0.02
    assert np.max(better) < 0.05 * np.max(plain)
