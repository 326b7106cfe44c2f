"""The sensors as a system: when they sample, and whose noise it is."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    TrajectorySource,
    VectorLogSink,
)
from pydrake.trajectories import PiecewisePolynomial
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sensing.joint_sensors import JointSensors
from drake_affetto.sensing.readings import NOISE_ROWS, SensorParameters

NOISY = SensorParameters(
    angle_resolution=0.001,
    angle_noise=0.002,
    pressure_resolution=300.0,
    pressure_noise=500.0,
    filter_cutoff=20.0,
)
T = 0.005


def simulate(parameters, seed=0, end=0.5, lead=0.0, start=0.0):
    """Logs (K, 2) of estimates and pressures of one joint that runs away."""
    builder = DiagramBuilder()
    way = PiecewisePolynomial.FirstOrderHold(
        [0.0, 100.0], [[0.0, 100.0], [1.0, 1.0]]
    )
    joints = builder.AddSystem(TrajectorySource(way))
    chambers = builder.AddSystem(ConstantVectorSource([4e5, 3e5]))
    dut = JointSensors.AddToBuilder(
        builder=builder,
        joint_state=joints.get_output_port(),
        true_pressure=chambers.get_output_port(),
        parameters=parameters,
        joint_names=["elbow"],
        q_lower=[-1.0],
        q_upper=[1.0],
        period=T,
        lead=lead,
    )
    logs: list[VectorLogSink] = [
        LogVectorOutput(port, builder, publish_period=T)
        for port in (
            dut.get_estimated_state_output_port(),
            dut.get_chamber_pressure_output_port(),
        )
    ]
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    mine = dut.GetMyMutableContextFromRoot(context)
    dut.set_seed(mine, seed)
    assert dut.seed(mine) == seed
    dut.reset(mine, [start, 0.0], [4e5, 3e5])
    context.SetTime(start)
    simulator = Simulator(diagram, context)
    simulator.AdvanceTo(start + end)
    return [log.FindLog(context).data().T.copy() for log in logs]


def test_until_the_first_sample_the_robot_rests_where_it_was_put():
    estimate, pressure = simulate(NOISY, lead=0.001)
    assert (estimate[0] == [0.0, 0.0]).all()
    assert (pressure[0] == [4e5, 3e5]).all()
    assert (estimate[1:, 0] != 0.0).all()


def test_sample_is_there_at_the_time_that_it_is_of():
    lead = 0.00125
    estimate, _ = simulate(SensorParameters(), lead=lead)
    expected = T * np.arange(1, len(estimate)) - lead
    np.testing.assert_allclose(estimate[1:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(estimate[2:, 1], 1.0)


def test_noise_is_that_of_the_seed():
    one, other = simulate(NOISY, seed=1), simulate(NOISY, seed=2)
    for first, second, third in zip(
        one, simulate(NOISY, seed=1), other, strict=True
    ):
        np.testing.assert_array_equal(first, second)
        assert np.abs(first - third).max() > 0.0


def test_noise_goes_on_beyond_a_block():
    _, pressure = simulate(NOISY, end=T * (NOISE_ROWS + 50))
    block = pressure[2 : NOISE_ROWS + 1, 0] - 4e5
    after = pressure[NOISE_ROWS + 1 :, 0] - 4e5
    assert after.std() == pytest.approx(500.0, rel=0.4)
    assert abs(np.corrcoef(after, block[: len(after)])[0, 1]) < 0.6


def test_noise_does_not_depend_on_where_the_simulation_began():
    _, whole = simulate(NOISY, end=1.0)
    _, late = simulate(NOISY, start=0.5, end=0.5)
    np.testing.assert_array_equal(late[5:], whole[105:])


def test_lead_is_within_the_period():
    with pytest.raises(InputError, match=r"lead is 0\.005"):
        JointSensors(NOISY, ["elbow"], [-1.0], [1.0], period=T, lead=T)
