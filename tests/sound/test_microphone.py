"""The microphone on small plants whose contact forces are known by statics."""

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactResults,
    CoulombFriction,
)
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    SpatialInertia,
    default_model_instance,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import configure_parser, resolve
from drake_affetto.sound.microphone import DrumMicrophone

GRAVITY = 9.81
BALL = 0.03


class Scene:
    """A drum and a table that stand still, and balls that fall on them."""

    def __init__(
        self,
        balls: dict[str, tuple[float, np.ndarray]],
        *,
        X_WD: RigidTransform | None = None,
        balls_first: bool = True,
    ):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        plant = self.plant
        if balls_first:
            self._add_balls(balls)
        self._add_drum(X_WD or RigidTransform())
        if not balls_first:
            self._add_balls(balls)
        plant.Finalize()
        self.microphone = DrumMicrophone.AddToBuilder(
            builder=builder, plant=plant
        )
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        for name, (_, p_WB) in balls.items():
            self.put(name, p_WB)

    def put(self, name, p_WB):
        self.plant.SetFreeBodyPose(
            self.plant.GetMyMutableContextFromRoot(self.context),
            self.plant.GetBodyByName(name),
            RigidTransform(np.asarray(p_WB, dtype=float)),
        )

    def hear(self):
        context = self.microphone.GetMyContextFromRoot(self.context)
        return (
            self.microphone.get_contact_force_output_port().Eval(context),
            self.microphone.get_knock_force_output_port().Eval(context),
        )

    def _add_balls(self, balls):
        for name, (mass, _) in balls.items():
            body = self.plant.AddRigidBody(
                name,
                default_model_instance(),
                SpatialInertia.SolidSphereWithMass(mass, BALL),
            )
            self._collide(body, RigidTransform(), Sphere(BALL), friction=0.9)

    def _add_drum(self, X_WD):
        plant = self.plant
        inertia = SpatialInertia.SolidCubeWithDensity(500.0, 0.1)
        drum = plant.AddModelInstance("drum")
        shell = plant.AddRigidBody("shell", drum, inertia)
        head = plant.AddRigidBody("head", drum, inertia)
        plant.WeldFrames(plant.world_frame(), shell.body_frame(), X_WD)
        # The head's frame is not the shell's, nor where the membrane is.
        plant.WeldFrames(
            shell.body_frame(),
            head.body_frame(),
            RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), [0.0, 0.0, 0.06]),
        )
        plant.AddFrame(
            FixedOffsetFrame(
                "head_center",
                head.body_frame(),
                RigidTransform([0.0, 0.0, 0.01]),
            )
        )
        self._collide(
            head, RigidTransform([0.0, 0.0, 0.005]), Cylinder(0.065, 0.01)
        )
        self._collide(
            shell, RigidTransform([0.0, 0.0, 0.03]), Cylinder(0.07, 0.058)
        )
        table = plant.AddModelInstance("table")
        top = plant.AddRigidBody("table_top", table, inertia)
        plant.WeldFrames(
            plant.world_frame(),
            top.body_frame(),
            RigidTransform([0.0, 0.0, -0.05]),
        )
        self._collide(top, RigidTransform(), Box(1.0, 1.0, 0.1))

    def _collide(self, body, X_BG, shape, friction=0.5):
        self.plant.RegisterCollisionGeometry(
            body,
            X_BG,
            shape,
            f"{body.name()}_collision",
            CoulombFriction(friction, friction),
        )


@pytest.mark.parametrize("balls_first", [True, False])
@pytest.mark.parametrize("place", [0.0, 0.02, 0.05])
def test_a_ball_at_rest_on_the_head_weighs_what_it_weighs(place, balls_first):
    scene = Scene(
        {"ball": (0.3, [place, 0.0, 0.07 + BALL])}, balls_first=balls_first
    )
    scene.simulator.AdvanceTo(0.5)
    contact, knock = scene.hear()
    np.testing.assert_allclose(
        contact, [0.3 * GRAVITY, place], rtol=1e-3, atol=1e-4
    )
    np.testing.assert_array_equal(knock, [0.0, 0.0])


def test_the_place_is_counted_from_the_drum_wherever_it_stands():
    X_WD = RigidTransform(RollPitchYaw(0.0, 0.0, 1.0), [0.2, -0.1, 0.03])
    p_WB = X_WD @ np.array([0.03, 0.04, 0.07 + BALL])
    scene = Scene({"ball": (0.3, p_WB)}, X_WD=X_WD)
    scene.simulator.AdvanceTo(0.5)
    contact, _ = scene.hear()
    np.testing.assert_allclose(contact, [0.3 * GRAVITY, 0.05], rtol=2e-3)


def test_two_touches_add_and_meet_between():
    scene = Scene(
        {
            "light": (0.1, [-0.03, 0.0, 0.07 + BALL]),
            "heavy": (0.3, [0.031, 0.0, 0.07 + BALL]),
        }
    )
    scene.simulator.AdvanceTo(0.5)
    contact, _ = scene.hear()
    between = (0.3 * 0.031 - 0.1 * 0.03) / 0.4
    np.testing.assert_allclose(contact, [0.4 * GRAVITY, between], rtol=1e-2)


def test_a_tilted_head_feels_only_what_is_normal_to_it():
    """Friction holds the ball for a moment; it does not drive the head."""
    tilt = 0.2
    X_WD = RigidTransform(RollPitchYaw(0.0, tilt, 0.0), [0.0, 0.0, 0.2])
    p_WB = X_WD @ np.array([0.0, 0.0, 0.07 + BALL])
    scene = Scene({"ball": (0.3, p_WB)}, X_WD=X_WD)
    scene.simulator.AdvanceTo(0.05)
    contact, knock = scene.hear()
    assert contact[0] == pytest.approx(0.3 * GRAVITY * np.cos(tilt), rel=0.02)
    assert knock[0] == 0.0


def test_table_and_shell_are_knocks():
    scene = Scene(
        {
            "on_table": (0.2, [0.3, 0.0, BALL]),
            "in_the_air": (0.1, [-0.4, 0.3, 1.0]),
        }
    )
    scene.simulator.AdvanceTo(0.2)
    contact, knock = scene.hear()
    np.testing.assert_array_equal(contact, [0.0, 0.0])
    np.testing.assert_allclose(knock, [0.0, 0.2 * GRAVITY], rtol=1e-3)
    # A drum that lies on its side rests a ball on its shell.
    X_WD = RigidTransform(RollPitchYaw(np.pi / 2, 0.0, 0.0), [0.0, 0.1, 0.3])
    p_WB = [0.0, 0.07, 0.37 + BALL]
    scene = Scene({"ball": (0.2, p_WB)}, X_WD=X_WD)
    scene.simulator.AdvanceTo(0.3)
    contact, knock = scene.hear()
    assert contact[0] == 0.0
    np.testing.assert_allclose(knock, [0.2 * GRAVITY, 0.0], rtol=2e-2)


def test_nothing_touched_nothing_heard_and_again_after_a_reset():
    up, down = [0.0, 0.0, 1.0], [0.02, 0.0, 0.07 + BALL]
    scene = Scene({"ball": (0.3, up)})
    scene.simulator.AdvanceTo(0.1)
    for values in scene.hear():
        np.testing.assert_array_equal(values, [0.0, 0.0])
    initial = scene.context.Clone()
    scene.put("ball", down)
    scene.simulator.AdvanceTo(0.5)
    first = scene.hear()
    assert first[0][0] > 0.0
    scene.context.SetTimeStateAndParametersFrom(initial)
    scene.simulator.Initialize()
    scene.simulator.AdvanceTo(0.11)
    for values in scene.hear():
        np.testing.assert_array_equal(values, [0.0, 0.0])


def test_ports_with_fixed_inputs():
    dut = DrumMicrophone(head=BodyIndex(2), shell=[BodyIndex(1)])
    context = dut.CreateDefaultContext()
    dut.get_contact_results_input_port().FixValue(context, ContactResults())
    # Without contact the poses are not even looked at.
    for name in ("contact_force", "knock_force"):
        port = dut.GetOutputPort(name)
        np.testing.assert_array_equal(port.Eval(context), [0.0, 0.0])
        assert port.size() == 2
    dut.get_body_poses_input_port().FixValue(context, Value([RigidTransform()]))
    np.testing.assert_array_equal(
        dut.get_contact_force_output_port().Eval(context), [0.0, 0.0]
    )
    assert dut.num_continuous_states() == 0
    assert context.num_total_states() == 0


def test_the_drum_of_the_models_can_be_heard():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    parser = Parser(plant, scene_graph)
    configure_parser(parser)
    parser.AddModels(str(resolve("package://drake_affetto/sdf/drum.sdf")))
    plant.WeldFrames(
        plant.world_frame(),
        plant.GetBodyByName("shell").body_frame(),
        RigidTransform([0.2, -0.1, 0.0]),
    )
    ball = plant.AddRigidBody(
        "ball",
        default_model_instance(),
        SpatialInertia.SolidSphereWithMass(0.2, BALL),
    )
    plant.RegisterCollisionGeometry(
        ball,
        RigidTransform(),
        Sphere(BALL),
        "ball",
        CoulombFriction(0.5, 0.5),
    )
    plant.Finalize()
    microphone = DrumMicrophone.AddToBuilder(builder=builder, plant=plant)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    X_WH = plant.GetFrameByName("head_center").CalcPoseInWorld(plant_context)
    plant.SetFreeBodyPose(
        plant_context,
        ball,
        RigidTransform(X_WH @ np.array([0.0, 0.025, BALL])),
    )
    simulator.AdvanceTo(0.5)
    contact = microphone.get_contact_force_output_port().Eval(
        microphone.GetMyContextFromRoot(context)
    )
    np.testing.assert_allclose(contact, [0.2 * GRAVITY, 0.025], rtol=1e-2)


def test_a_body_has_one_part():
    with pytest.raises(InputError, match="shell"):
        DrumMicrophone(head=BodyIndex(2), shell=[BodyIndex(2)])
    with pytest.raises(InputError, match="table"):
        DrumMicrophone(
            head=BodyIndex(2), shell=[BodyIndex(3)], table=[BodyIndex(3)]
        )
