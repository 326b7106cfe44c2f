"""A person's pull by mouse: where it acts, how strong, and on what."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
)
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.visualization import VisualizationConfig
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.teaching import mouse_teacher
from drake_affetto.teaching.mouse_teacher import MouseTeacher
from drake_affetto.teaching.stroke import TeacherConfig
from support.mouse_messages import drag_message

MASS = 0.06
CONFIG = TeacherConfig()
HAS_SPRING = any(
    f.name == "mouse_interaction_stiffness"
    for f in VisualizationConfig.__fields__
)
needs_spring = pytest.mark.skipif(
    not HAS_SPRING, reason="this version of Drake has no mouse spring"
)


def make_plant(builder):
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    for name in ("hand", "drum"):
        plant.AddRigidBody(
            name, SpatialInertia.SolidSphereWithMass(MASS, radius=0.03)
        )
    plant.AddFrame(
        FixedOffsetFrame(
            "right_palm", plant.GetBodyByName("hand"), RigidTransform()
        )
    )
    plant.Finalize()
    return plant, scene_graph


@pytest.fixture(scope="module")
def plant():
    return make_plant(DiagramBuilder())[0]


@pytest.fixture
def teacher(plant):
    return MouseTeacher(plant, CONFIG)


def fix(teacher, plant, X_WB, V_WB, drags):
    """A context in which the mouse drags bodies from anchors to targets."""
    context = teacher.CreateDefaultContext()
    move(teacher, context, plant, X_WB, V_WB, drags)
    return context


def move(teacher, context, plant, X_WB, V_WB, drags):
    forces = []
    for name, anchor, target in drags:
        body = plant.GetBodyByName(name)
        arm = anchor - X_WB.translation()
        v = V_WB.translational() + np.cross(V_WB.rotational(), arm)
        # Drake's law: stiffness per kilogram, critical damping by its root.
        k = CONFIG.stiffness / MASS
        force = ExternallyAppliedSpatialForce()
        force.body_index = body.index()
        force.p_BoBq_B = X_WB.inverse() @ anchor
        force.F_Bq_W = SpatialForce(
            tau=np.zeros(3),
            f=MASS * k * (target - anchor) - MASS * np.sqrt(k) * v,
        )
        forces.append(force)
    teacher.get_mouse_force_input_port().FixValue(context, forces)
    n = plant.num_bodies()
    teacher.GetInputPort("body_poses").FixValue(context, [X_WB] * n)
    teacher.GetInputPort("body_spatial_velocities").FixValue(
        context, [V_WB] * n
    )


def pull(teacher, context):
    forces = teacher.get_spatial_force_output_port().Eval(context)
    size = teacher.get_pulling_force_output_port().Eval(context)
    assert len(forces) <= 1
    if not forces:
        np.testing.assert_array_equal(size, np.zeros(3))
        return None
    np.testing.assert_array_equal(size, forces[0].F_Bq_W.translational())
    np.testing.assert_array_equal(forces[0].F_Bq_W.rotational(), np.zeros(3))
    return forces[0]


def update(teacher, context):
    event = teacher.GetUniquePeriodicDiscreteUpdateAttribute()
    assert event.period_sec() == pytest.approx(1 / CONFIG.update_rate)
    values = teacher.EvalUniquePeriodicDiscreteUpdate(context)
    context.SetDiscreteState(values)


def random_motion(rng):
    X_WB = RigidTransform(
        RotationMatrix.MakeZRotation(rng.uniform(-2, 2)),
        rng.uniform(-0.3, 0.3, 3),
    )
    V_WB = SpatialVelocity(w=rng.uniform(-1, 1, 3), v=rng.uniform(-0.2, 0.2, 3))
    return X_WB, V_WB


@pytest.mark.parametrize("seed", range(5))
def test_the_arm_is_a_spring_and_damper_about_the_grabbed_point(
    plant, teacher, seed
):
    rng = np.random.default_rng(seed)
    grip_B = rng.uniform(-0.03, 0.03, 3)
    X_WB, V_WB = random_motion(rng)
    context = fix(
        teacher, plant, X_WB, V_WB, [("hand", X_WB @ grip_B, X_WB @ grip_B)]
    )
    update(teacher, context)
    # The hand moves on, and the browser is late: it still draws the grabbed
    # point, and so the anchor, where it was.
    X_now, V_now = random_motion(rng)
    target = X_now @ grip_B + rng.uniform(-0.01, 0.01, 3)
    stale = X_WB @ grip_B
    move(teacher, context, plant, X_now, V_now, [("hand", stale, target)])
    force = pull(teacher, context)
    np.testing.assert_allclose(force.p_BoBq_B, grip_B, atol=1e-12)
    p = X_now @ grip_B
    v = V_now.translational() + np.cross(
        V_now.rotational(), p - X_now.translation()
    )
    expected = CONFIG.stiffness * (target - p) - CONFIG.damping * v
    assert 0 < np.linalg.norm(expected) < CONFIG.max_force
    np.testing.assert_allclose(
        force.F_Bq_W.translational(), expected, atol=1e-9
    )


def test_the_pull_is_within_a_persons_strength(plant, teacher):
    X, V = RigidTransform(), SpatialVelocity.Zero()
    far = np.array([0.3, -0.4, 0.0])
    context = fix(teacher, plant, X, V, [("hand", np.zeros(3), far)])
    force = pull(teacher, context).F_Bq_W.translational()
    np.testing.assert_allclose(force, CONFIG.max_force * far / 0.5)


def test_only_the_hand_can_be_taken_hold_of(plant, teacher):
    X, V, there = RigidTransform(), SpatialVelocity.Zero(), np.full(3, 0.02)
    context = fix(teacher, plant, X, V, [("drum", np.zeros(3), there)])
    update(teacher, context)
    assert pull(teacher, context) is None
    context = fix(teacher, plant, X, V, [])
    assert pull(teacher, context) is None


def test_whoever_lets_go_may_grab_another_point(plant, teacher):
    X, V = RigidTransform(), SpatialVelocity.Zero()
    first, second = np.array([0.01, 0, 0]), np.array([0, 0.02, 0])
    context = fix(teacher, plant, X, V, [("hand", first, first)])
    update(teacher, context)
    move(teacher, context, plant, X, V, [])
    update(teacher, context)
    move(teacher, context, plant, X, V, [("hand", second, second)])
    update(teacher, context)
    np.testing.assert_array_equal(pull(teacher, context).p_BoBq_B, second)


@needs_spring
def test_drakes_own_mouse_spring_pulls_the_hand():
    builder = DiagramBuilder()
    plant, scene_graph = make_plant(builder)
    meshcat = Meshcat()
    teacher = MouseTeacher.AddToBuilder(
        builder=builder,
        plant=plant,
        scene_graph=scene_graph,
        meshcat=meshcat,
        config=CONFIG,
        name="person",
    )
    assert teacher.get_name() == "person"
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    hand = plant.GetBodyByName("hand")
    mine = plant.GetMyContextFromRoot(context)
    target = [0.02, 0.0, 0.01]
    meshcat._InjectWebsocketMessage(
        drag_message("/drake/visualizer/hand/ball", [0, 0, 0], target)
    )
    force = teacher.get_pulling_force_output_port()
    np.testing.assert_allclose(
        force.Eval(teacher.GetMyContextFromRoot(context)),
        CONFIG.stiffness * np.array(target),
        atol=1e-9,
    )
    simulator.AdvanceTo(2.0)
    np.testing.assert_allclose(
        hand.EvalPoseInWorld(mine).translation(), target, atol=1e-3
    )
    meshcat._InjectWebsocketMessage(drag_message())
    simulator.AdvanceTo(2.01)
    np.testing.assert_array_equal(
        force.Eval(teacher.GetMyContextFromRoot(context)), np.zeros(3)
    )


def test_a_drake_without_mouse_spring_is_told_of(monkeypatch):
    monkeypatch.setattr(mouse_teacher, "_STIFFNESS", "no such field")
    with pytest.raises(InputError, match="needs a Drake"):
        mouse_teacher.require_mouse_spring()
