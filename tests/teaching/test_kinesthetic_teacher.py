"""The teacher as a system: ports, state and what it does to a context."""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.scene import world
from drake_affetto.teaching.kinesthetic_teacher import KinestheticTeacher
from drake_affetto.teaching.stroke import (
    TeacherConfig,
    TeacherState,
    advance_teacher,
    draw_stroke,
    intended_position,
    tremor_force,
)

NAMES = ["waist_yaw", "right_shoulder_flexion", "right_elbow_flexion"]


@pytest.fixture(scope="module")
def plant():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(), builder)
    world.add_world(plant, world.WorldConfig())
    plant.Finalize()
    plant.diagram = builder.Build()  # keeps the SceneGraph alive
    return plant


@pytest.fixture
def teacher(plant):
    return KinestheticTeacher(plant, NAMES, TeacherConfig())


def palm_of(plant, q):
    context = plant.CreateDefaultContext()
    for name, angle in zip(NAMES, q, strict=True):
        world.get_joint(plant, name).set_angle(context, angle)
    frame = plant.GetFrameByName("right_palm")
    return frame.CalcPoseInWorld(context).translation()


def test_the_palm_and_its_velocity_are_those_of_the_plant(plant, teacher):
    q, v = np.array([0.1, 0.4, 1.5]), np.array([0.3, -0.5, 0.7])
    palm, velocity = teacher.palm(np.concatenate([q, v]))
    np.testing.assert_allclose(palm, palm_of(plant, q), atol=1e-12)
    h = 1e-6
    numeric = (palm_of(plant, q + h * v) - palm_of(plant, q - h * v)) / (2 * h)
    np.testing.assert_allclose(velocity, numeric, atol=1e-8)


def test_without_a_stroke_nobody_pulls(teacher):
    context = teacher.CreateDefaultContext()
    teacher.get_estimated_state_input_port().FixValue(context, np.zeros(6))
    simulator = Simulator(teacher, context)
    simulator.AdvanceTo(0.1)
    assert teacher.get_spatial_force_output_port().Eval(context) == []
    pulling = teacher.get_pulling_force_output_port().Eval(context)
    np.testing.assert_array_equal(pulling, np.zeros(3))


def test_an_added_teacher_acts_on_the_plant():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(), builder)
    world.add_world(plant, world.WorldConfig())
    plant.Finalize()
    teacher = KinestheticTeacher.AddToBuilder(
        builder=builder,
        plant=plant,
        joint_names=NAMES,
        config=TeacherConfig(),
        name="person",
    )
    assert teacher.get_name() == "person"
    port = plant.get_applied_spatial_force_input_port()
    source, _ = builder.connection_map()[(plant, port.get_index())]
    assert source is teacher


def run(teacher, plant, q, duration):
    context = teacher.CreateDefaultContext()
    state = np.concatenate([q, np.zeros(3)])
    teacher.get_estimated_state_input_port().FixValue(context, state)
    grasp = palm_of(plant, q)
    stroke = draw_stroke(
        TeacherConfig(), grasp + [0.05, 0, -0.1], np.random.default_rng(1)
    )
    teacher.set_stroke(context, stroke, 0.1)
    simulator = Simulator(teacher, context)
    simulator.AdvanceTo(0.1 + duration)
    return context, stroke, grasp


def test_the_updates_are_those_of_the_mathematics(plant, teacher):
    q = np.array([0.0, 0.2, 1.6])
    updates = 60
    context, stroke, grasp = run(teacher, plant, q, 0.005 * (updates - 0.5))
    config = TeacherConfig()
    state = TeacherState.at(grasp)
    for k in range(updates):
        t = 0.005 * k
        state = advance_teacher(
            config,
            state,
            intended_position(stroke, grasp, t),
            grasp,
            np.zeros(3),
            tremor_force(stroke, t),
            0.005,
        )
    pulling = teacher.get_pulling_force_output_port().Eval(context)
    np.testing.assert_allclose(pulling, state.force, rtol=1e-9, atol=1e-9)
    (applied,) = teacher.get_spatial_force_output_port().Eval(context)
    np.testing.assert_array_equal(applied.F_Bq_W.translational(), pulling)
    np.testing.assert_array_equal(applied.F_Bq_W.rotational(), np.zeros(3))
    hand = plant.GetBodyByName("right_hand")
    assert applied.body_index == hand.index()


def test_the_teacher_lets_go_at_the_end(plant, teacher):
    context, _, _ = run(
        teacher,
        plant,
        np.array([0.0, 0.2, 1.6]),
        TeacherConfig().duration + 0.1,
    )
    pulling = teacher.get_pulling_force_output_port().Eval(context)
    np.testing.assert_array_equal(pulling, np.zeros(3))


def test_a_new_stroke_begins_anew(plant, teacher):
    q = np.array([0.0, 0.2, 1.6])
    context, stroke, _ = run(teacher, plant, q, 1.0)
    first = teacher.get_pulling_force_output_port().Eval(context)
    assert np.linalg.norm(first) > 0.1
    teacher.set_stroke(context, None, np.inf)
    assert teacher.get_spatial_force_output_port().Eval(context) == []
    context.SetTime(0.0)
    teacher.set_stroke(context, stroke, 0.1)
    simulator = Simulator(teacher, context)
    simulator.AdvanceTo(1.1)
    again = teacher.get_pulling_force_output_port().Eval(context)
    np.testing.assert_array_equal(first, again)


def test_a_stroke_without_a_time_is_refused(plant, teacher):
    context = teacher.CreateDefaultContext()
    stroke = draw_stroke(TeacherConfig(), np.zeros(3), np.random.default_rng(1))
    with pytest.raises(InputError, match="start_time"):
        teacher.set_stroke(context, stroke, np.inf)
