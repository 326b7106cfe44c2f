"""Gravity of the desired posture as an offset of the demand."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.gravity_feedforward import GravityFeedforward

MASS, LENGTH, SLOPE, OFFSET = 0.5, 0.3, 2e5, 1e4


@pytest.fixture(scope="module")
def plant():
    """A bar that hangs down at 0, about an axis along y."""
    plant = MultibodyPlant(0.0)
    bar = plant.AddRigidBody(
        "bar",
        SpatialInertia(
            MASS,
            [0.0, 0.0, -LENGTH],
            UnitInertia(LENGTH**2 + 1e-4, LENGTH**2 + 1e-4, 1e-4),
        ),
    )
    plant.AddJoint(
        RevoluteJoint(
            "hinge", plant.world_frame(), bar.body_frame(), [0.0, 1.0, 0.0]
        )
    )
    plant.Finalize()
    return plant


def made(plant, **options):
    dut = GravityFeedforward(plant, ["hinge"], [SLOPE], [OFFSET], **options)
    context = dut.CreateDefaultContext()
    dut.get_desired_state_input_port().FixValue(context, [0.7, 3.0])
    return dut, context


def updated(dut, context):
    context.SetDiscreteState(dut.EvalUniquePeriodicDiscreteUpdate(context))
    return dut.get_equilibrium_offset_output_port().Eval(context)


def expected(q):
    # About y, the bar's weight turns it back to 0: it takes +m g l sin q.
    return SLOPE * MASS * 9.81 * LENGTH * np.sin(q) + OFFSET


@pytest.mark.parametrize("q", [-0.4, 0.0, 0.7])
def test_what_holds_a_bar_is_its_weight_times_the_lever(plant, q):
    dut, _ = made(plant)
    np.testing.assert_allclose(dut.holding(np.array([q])), expected(q))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_share_of_gravity_at_the_desired_angle(plant, share):
    dut, context = made(plant, share=share)
    np.testing.assert_allclose(updated(dut, context), [share * expected(0.7)])
    np.testing.assert_allclose(
        dut.reset(context, np.array([0.2])), [share * expected(0.2)]
    )


def test_constant_takes_the_place_of_gravity(plant):
    dut, context = made(plant)
    dut.set_constant(context, [123.0])
    port = dut.get_equilibrium_offset_output_port()
    assert port.Eval(context) == [123.0]
    assert updated(dut, context) == [123.0]


def test_share_is_between_0_and_1(plant):
    with pytest.raises(InputError, match=r"share is 1\.5"):
        made(plant, share=1.5)
