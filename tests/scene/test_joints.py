"""Joints of any model by their names."""

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.scene import world
from drake_affetto.scene.joints import joint_names, select_joints

ACTIVE = list(world.ACTIVE_JOINTS)
ODD = """<sdf version="1.9"><model name="odd">
  <link name="a"/><link name="b"/><link name="c"/>
  <joint name="ball" type="ball"><parent>world</parent><child>a</child></joint>
  <joint name="weak" type="revolute"><parent>a</parent><child>b</child>
    <axis><xyz>0 0 1</xyz><limit><effort>0</effort></limit></axis></joint>
  <joint name="lift" type="prismatic"><parent>b</parent><child>c</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-0.1</lower><upper>0.3</upper>
    </limit></axis></joint>
</model></sdf>"""


@pytest.fixture(scope="module")
def arms():
    """Two arms of one kind, and a model with joints of other kinds."""
    plant = MultibodyPlant(0.001)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    file = str(models_dir() / "sdf/two_link_arm.sdf")
    left, right = (parser.AddModels(file)[0] for _ in range(2))
    odd = parser.AddModelsFromString(ODD, "sdf")[0]
    plant.Finalize()
    return plant, left, right, odd


def test_a_selection_picks_state_and_actuation_by_name(scene):
    plant, context = scene.plant, scene.context
    robot = world.robot_instance(plant)
    selection = select_joints(plant, ACTIVE, robot)
    rng = np.random.default_rng(0)
    for name in world.joint_names(plant):
        joint = world.get_joint(plant, name)
        joint.set_angle(context, rng.uniform(-0.1, 0.1))
        joint.set_angular_rate(context, rng.uniform(-1, 1))
    state = plant.get_state_output_port(robot).Eval(context)
    joints = [world.get_joint(plant, name) for name in ACTIVE]
    expected = [j.get_angle(context) for j in joints] + [
        j.get_angular_rate(context) for j in joints
    ]
    assert selection.state_matrix @ state == pytest.approx(expected)
    n = len(ACTIVE)
    assert state[selection.positions] == pytest.approx(expected[:n])
    velocities = plant.GetVelocities(context, robot)
    assert velocities[selection.velocities] == pytest.approx(expected[n:])
    torque = np.arange(1.0, n + 1)
    actuation = selection.actuation_matrix @ torque
    assert actuation[selection.actuators] == pytest.approx(torque)
    for i, name in enumerate(ACTIVE):
        actuator = plant.GetJointActuatorByName(name, robot)
        u = np.zeros(plant.num_actuated_dofs())
        actuator.set_actuation_vector(np.array([torque[i]]), u)
        assert actuation[u != 0] == pytest.approx([torque[i]])


@pytest.mark.parametrize("names", [[], ["waist_yaw", "waist_yaw"]])
def test_a_selection_is_not_empty_and_names_nothing_twice(scene, names):
    plant = scene.plant
    with pytest.raises(InputError, match="none of them twice"):
        select_joints(plant, names, world.robot_instance(plant))


def test_joints_of_the_same_name_belong_to_their_model(arms):
    plant, left, right, _ = arms
    context = plant.CreateDefaultContext()
    for k, instance in enumerate((left, right)):
        for i, name in enumerate(("shoulder", "elbow")):
            joint = plant.GetJointByName(name, instance)
            joint.set_angle(context, 0.1 * (i + 1) + k)
    for k, instance in enumerate((left, right)):
        selection = select_joints(plant, ["elbow", "shoulder"], instance)
        state = plant.get_state_output_port(instance).Eval(context)
        angles = selection.state_matrix @ state
        assert angles[:2] == pytest.approx([0.2 + k, 0.1 + k])
        assert selection.model_instance == instance
        assert selection.lower == pytest.approx([0.0, -1.0])
        assert selection.upper == pytest.approx([2.2, 1.5])


def test_a_prismatic_joint_is_a_joint_like_others(arms):
    plant, _, _, odd = arms
    assert joint_names(plant, odd) == ["weak", "lift"]
    selection = select_joints(plant, ["lift"], odd)
    assert (selection.lower, selection.upper) == ([-0.1], [0.3])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("elbo", "model odd has no joint 'elbo'; known are weak, lift"),
        ("lifts", "did you mean lift"),
        ("ball", "type of joint ball is 'ball.*expected one with one degree"),
        ("weak", "actuator of joint weak is None, expected one in the model"),
    ],
)
def test_joints_that_do_not_fit_are_named(arms, name, message):
    plant, _, _, odd = arms
    with pytest.raises(InputError, match=message):
        select_joints(plant, [name], odd)
