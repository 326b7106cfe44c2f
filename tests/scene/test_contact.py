"""What touches what, how softly, and that geometry follows the drum."""

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo
import pytest

from drake_affetto.geometry.kinematics import solve_position
from drake_affetto.scene import world
from support.drumming_scene import build_scene

ARM = [
    "right_shoulder_abduction",
    "right_shoulder_flexion",
    "right_elbow_rotation",
    "right_elbow_flexion",
]
XY = [0.24, -0.10]


@pytest.fixture(scope="module")
def still_scene():
    """Steps so short that nothing moves while contact is resolved."""
    scene = build_scene(1e-5)
    robot = scene.plant.GetModelInstanceByName("affetto")
    scene.plant.get_actuation_input_port(robot).FixValue(
        scene.context, np.zeros(22)
    )
    return scene


@pytest.fixture
def scene(still_scene):
    plant, context = still_scene.plant, still_scene.context
    plant.SetPositions(context, plant.GetDefaultPositions())
    world.set_drum_position(plant, context, XY)
    return still_scene


def press(scene, depth, xy=XY):
    """Puts palm over `xy`, its lowest point `depth` below the drum's head."""
    plant, context = scene.plant, scene.context
    chain = world.serial_chain(plant, "right_palm")
    rest = chain.posture(world.get_posture(plant, context))
    weights = np.isin(chain.names, [*ARM, "waist_pitch"]).astype(float)
    head = world.head_center_position(plant, context)[2]
    hand = world.hand_radius(plant, context)
    target = [*xy, head + hand - depth]
    q, left = solve_position(
        chain, [target], rest, weights, damping=1e-3, iterations=400
    )
    assert left[0] < 1e-6
    posture = dict(zip(chain.names, q[0], strict=True))
    world.set_posture(plant, context, posture)


def forces(scene):
    """(first body, second body) -> normal force [N], of all contacts."""
    plant, context = scene.plant, scene.context
    results = plant.get_contact_results_output_port().Eval(context)
    found = {}
    for i in range(results.num_point_pair_contacts()):
        info = results.point_pair_contact_info(i)
        bodies = frozenset(
            str(plant.get_body(b).scoped_name())
            for b in (info.bodyA_index(), info.bodyB_index())
        )
        normal = info.point_pair().nhat_BA_W
        force = abs(info.contact_force() @ normal)
        found[bodies] = found.get(bodies, 0.0) + force
    return found


STRIKE = frozenset(["affetto::right_hand", "drum::head"])


@pytest.mark.parametrize("depth", [0.004, 0.010, 0.016])
def test_the_hand_is_a_spring_of_600_newton_a_meter(scene, depth):
    press(scene, depth)
    found = forces(scene)
    assert set(found) == {STRIKE}
    assert found[STRIKE] == pytest.approx(601 * depth, rel=0.01)


def test_the_hand_gives_at_most_25_mm_when_a_person_pushes(scene):
    press(scene, 0.025)
    assert forces(scene)[STRIKE] > 30.0


def test_contact_follows_the_drum(scene):
    press(scene, 0.01)
    assert STRIKE in forces(scene)
    world.set_drum_position(scene.plant, scene.context, [0.40, 0.10])
    assert forces(scene) == {}
    world.set_drum_position(scene.plant, scene.context, XY)
    assert STRIKE in forces(scene)


def test_the_rim_is_the_shell_s(scene):
    press(scene, 0.006, [XY[0] + 0.038, XY[1]])
    found = forces(scene)
    rim = frozenset(["affetto::right_hand", "drum::shell"])
    assert found[rim] > 1.0


def test_drum_and_table_do_not_push_each_other(scene):
    world.set_posture(scene.plant, scene.context, {"right_elbow_flexion": 2.2})
    assert forces(scene) == {}


def test_a_hard_fall_on_the_table_sinks_in_at_most_two_millimeters():
    """The forearm falls on the edge of the table, its muscles slack."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(
        MultibodyPlantConfig(
            time_step=0.001, discrete_contact_approximation="lagged"
        ),
        builder,
    )
    # Leaning far forward, the arm stretched out over the table.
    posture = {
        "waist_pitch": 0.65,
        "lumbar_pitch": 0.35,
        "chest_pitch": 0.0,
        "right_shoulder_elevation": 0.0,
        "right_shoulder_abduction": 0.0,
        "right_shoulder_flexion": 2.05,
        "right_elbow_flexion": 0.4,
        "right_elbow_rotation": 0.0,
        "right_wrist_flexion": -0.7,
    }
    world.add_world(
        plant,
        world.WorldConfig(drum_position=[0.45, 0.25], default_posture=posture),
    )
    world.weld_inactive(plant, ["right_shoulder_flexion"])
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    robot = plant.GetModelInstanceByName("affetto")
    plant.get_actuation_input_port(robot).FixValue(context, np.zeros(1))
    shoulder = world.get_joint(plant, "right_shoulder_flexion")
    shoulder.set_angular_rate(context, -4.0)
    query_port = plant.get_geometry_query_input_port()
    deepest, touched, fastest = 0.0, set(), 0.0
    for step in range(1, 300):
        simulator.AdvanceTo(step * 0.001)
        query = query_port.Eval(context)
        inspector = query.inspector()
        for pair in query.ComputePointPairPenetration():
            names = {inspector.GetName(pair.id_A), inspector.GetName(pair.id_B)}
            if names <= {"affetto::forearm", "affetto::wrist", "table::top"}:
                deepest = max(deepest, pair.depth)
                touched |= names
        if not touched:
            fastest = abs(shoulder.get_angular_rate(context))
    assert "table::top" in touched
    assert fastest > 1.0
    assert 0 < deepest <= 0.002


def test_what_is_rendered_follows_the_drum():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(
        MultibodyPlantConfig(time_step=0.001), builder
    )
    world.add_world(plant, world.WorldConfig())
    plant.Finalize()
    scene_graph.AddRenderer(
        "mirror", MakeRenderEngineVtk(RenderEngineVtkParams())
    )
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    info = CameraInfo(160, 120, 0.8)
    camera = ColorRenderCamera(
        RenderCameraCore(
            "mirror", info, ClippingRange(0.05, 5.0), RigidTransform()
        )
    )
    # Straight above, looking down, image right is -y of the world.
    X_WC = RigidTransform(
        RotationMatrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]), [0.3, 0.0, 0.8]
    )
    head = plant.GetBodyByName("head", plant.GetModelInstanceByName("drum"))
    for xy in ([0.25, -0.10], [0.40, 0.10]):
        world.set_drum_position(plant, context, xy)
        query = scene_graph.get_query_output_port().Eval(
            scene_graph.GetMyContextFromRoot(root)
        )
        label = query.RenderLabelImage(
            camera, scene_graph.world_frame_id(), X_WC
        ).data[..., 0]
        v, u = np.nonzero(label == int(head.index()))
        center = world.head_center_position(plant, context)
        p_C = X_WC.inverse() @ center
        expected = info.focal_x() * p_C[:2] / p_C[2] + [79.5, 59.5]
        assert [u.mean(), v.mean()] == pytest.approx(expected, abs=1.5)
