"""The force of a teacher on the hand, as ports of a system."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
import pytest

from drake_affetto.teaching.hand_force import HandForce

POINT, FORCE = np.array([0.01, -0.02, 0.03]), np.array([1.0, -2.0, 0.5])


class Teacher(HandForce):
    """Pulls with `FORCE` at `POINT` where its state is above zero."""

    def __init__(self, hand):
        super().__init__()
        self._held = self.DeclareDiscreteState(1)
        self._declare_outputs(hand, {self.xd_ticket()})

    def _pull(self, context):
        held = context.get_discrete_state(self._held).value()[0] > 0.0
        return (POINT, FORCE) if held else None


@pytest.fixture
def hand():
    plant = MultibodyPlant(0.001)
    plant.AddRigidBody("arm", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    return plant.AddRigidBody(
        "hand", SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    )


def test_without_a_grasp_there_is_no_force(hand):
    dut = Teacher(hand)
    context = dut.CreateDefaultContext()
    assert dut.get_spatial_force_output_port().Eval(context) == []
    pull = dut.get_pulling_force_output_port().Eval(context)
    np.testing.assert_array_equal(pull, np.zeros(3))
    assert not dut.HasAnyDirectFeedthrough()


def test_both_ports_tell_of_the_same_force_on_the_same_hand(hand):
    dut = Teacher(hand)
    context = dut.CreateDefaultContext()
    # Evaluated before, so that a missing prerequisite would show.
    dut.get_spatial_force_output_port().Eval(context)
    context.SetDiscreteState([1.0])
    (force,) = dut.get_spatial_force_output_port().Eval(context)
    assert force.body_index == hand.index()
    np.testing.assert_array_equal(force.p_BoBq_B, POINT)
    np.testing.assert_array_equal(force.F_Bq_W.translational(), FORCE)
    np.testing.assert_array_equal(force.F_Bq_W.rotational(), np.zeros(3))
    pull = dut.get_pulling_force_output_port().Eval(context)
    np.testing.assert_array_equal(pull, FORCE)


def test_who_does_not_say_how_it_pulls_is_found_out(hand):
    dut = HandForce()
    dut._declare_outputs(hand, {dut.xd_ticket()})
    with pytest.raises(NotImplementedError):
        dut.get_pulling_force_output_port().Eval(dut.CreateDefaultContext())
