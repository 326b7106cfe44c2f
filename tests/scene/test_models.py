"""The models: joints, masses, symmetry, contact materials, meshes."""

import colorsys
import importlib.util
import logging
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from pydrake.geometry import Mesh, Role
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex
import pytest

from drake_affetto.common.resources import models_dir
from drake_affetto.scene import world

# name, lower, upper [deg], length to the next joint [m], mass [kg], class
TRUNK = [
    ("waist_yaw", -45, 45, 0.02, 0.15, "W"),
    ("waist_pitch", -15, 40, 0.03, 0.20, "W"),
    ("waist_roll", -20, 20, 0.05, 0.35, "W"),
    ("lumbar_pitch", -15, 25, 0.06, 0.40, "W"),
    ("chest_pitch", -10, 20, None, 1.00, "W"),
    ("neck_yaw", -60, 60, 0.02, 0.10, "N"),
    ("neck_pitch", -30, 40, 0.02, 0.10, "N"),
    ("neck_roll", -25, 25, None, 1.40, "N"),
]
ARM = [
    ("shoulder_elevation", 0, 25, 0.06, 0.07, "S"),
    ("shoulder_abduction", 0, 100, 0.015, 0.09, "S"),
    ("shoulder_flexion", -30, 120, 0.015, 0.09, "S"),
    ("elbow_rotation", -60, 60, 0.145, 0.12, "R"),
    ("elbow_flexion", 0, 130, 0.06, 0.10, "E"),
    ("wrist_supination", -70, 70, 0.055, 0.07, "R"),
    ("wrist_flexion", -45, 45, None, 0.06, "H"),
]
JOINTS = TRUNK + [
    (f"{side}_{name}", *rest)
    for side in ("left", "right")
    for name, *rest in ARM
]
# class: effort limit [N m], damping [N m s/rad], reflected inertia [kg m²]
CLASSES = {
    "W": (18.0, 0.32, (5e-3, 2e-2)),
    "S": (4.8, 0.08, (5e-4, 2e-3)),
    "R": (1.8, 0.024, (5e-4, 2e-3)),
    "E": (3.0, 0.09, (5e-4, 2e-3)),
    "H": (0.72, 0.008, (1e-4, 2e-3)),
    "N": (3.6, 0.06, (5e-4, 2e-3)),
}

ROOT = Path(__file__).parents[2]


def test_there_are_exactly_the_22_joints_each_with_its_actuator(scene):
    names = [row[0] for row in JOINTS]
    assert sorted(world.joint_names(scene.plant)) == sorted(names)
    robot = scene.plant.GetModelInstanceByName("affetto")
    assert scene.plant.num_positions() == 22
    assert scene.plant.num_actuators(robot) == 22
    for name in names:
        actuator = scene.plant.GetJointActuatorByName(name, robot)
        assert actuator.joint().name() == name


@pytest.mark.parametrize("row", JOINTS, ids=lambda row: row[0])
def test_a_joint_follows_the_table(scene, row):
    name, low, high, length, mass, kind = row
    plant = scene.plant
    joint = world.get_joint(plant, name)
    assert joint.position_lower_limit() == pytest.approx(np.radians(low), 1e-5)
    assert joint.position_upper_limit() == pytest.approx(np.radians(high), 1e-5)
    child = joint.child_body()
    assert child.default_mass() == pytest.approx(mass)
    ends = {
        "chest_pitch": "chest",
        "neck_roll": "head",
        "left_wrist_flexion": "left_hand",
        "right_wrist_flexion": "right_hand",
    }
    assert child.name() == ends.get(name, f"{name}_link")
    if length is not None:
        outer = [
            plant.get_joint(JointIndex(i))
            for i in range(plant.num_joints())
            if plant.get_joint(JointIndex(i)).parent_body().index()
            == child.index()
        ]
        offset = outer[0].frame_on_parent().GetFixedPoseInBodyFrame()
        assert np.linalg.norm(offset.translation()) == pytest.approx(length)
    effort, damping, (least, most) = CLASSES[kind]
    actuator = plant.GetJointActuatorByName(name)
    assert actuator.effort_limit() == effort
    assert joint.default_damping() == damping
    reflected = (
        actuator.default_rotor_inertia() * actuator.default_gear_ratio() ** 2
    )
    assert least <= reflected <= most


def test_the_robot_weighs_what_it_should(scene):
    robot = scene.plant.GetModelInstanceByName("affetto")
    moving = sum(
        scene.plant.get_body(i).default_mass()
        for i in scene.plant.GetBodyIndices(robot)
        if scene.plant.get_body(i).name() != "pelvis"
    )
    assert moving == pytest.approx(4.9)


def test_inertias_are_those_of_bodies_of_a_plausible_size(scene):
    robot = scene.plant.GetModelInstanceByName("affetto")
    for index in scene.plant.GetBodyIndices(robot):
        body = scene.plant.get_body(index)
        inertia = body.default_spatial_inertia()
        assert inertia.IsPhysicallyValid()
        central = inertia.Shift(inertia.get_com()).CalcRotationalInertia()
        radii = np.sqrt(central.get_moments() / body.default_mass())
        # Radii of gyration of solids that fit the link.
        assert np.all(radii > 0.004), body.name()
        assert np.all(radii < 0.08), body.name()


def _hand(scene, side, **angles):
    scene.reset()
    zero = dict.fromkeys(world.joint_names(scene.plant), 0.0)
    posture = {
        (name if name in zero else f"{side}_{name}"): angle
        for name, angle in angles.items()
    }
    world.set_posture(scene.plant, scene.context, {**zero, **posture})
    frame = scene.plant.GetFrameByName(f"{side}_hand")
    return frame.CalcPoseInWorld(scene.context)


@pytest.mark.parametrize("side", ["left", "right"])
def test_positive_angles_move_both_arms_alike(scene, side):
    outwards = 1 if side == "left" else -1
    rest = _hand(scene, side).translation()
    assert rest == pytest.approx([0.0, outwards * 0.085, -0.05], abs=1e-9)
    moved = {
        name: _hand(scene, side, **{name: 0.3}).translation() - rest
        for name in (
            "shoulder_elevation",
            "shoulder_abduction",
            "shoulder_flexion",
            "elbow_flexion",
            "waist_pitch",
        )
    }
    assert moved["shoulder_elevation"][2] > 0.01
    assert outwards * moved["shoulder_abduction"][1] > 0.05
    assert moved["shoulder_flexion"][0] > 0.05
    assert moved["elbow_flexion"][0] > 0.03
    assert moved["elbow_flexion"][2] > 0
    bent = _hand(scene, side, elbow_flexion=1.5).translation()
    inwards = _hand(scene, side, elbow_flexion=1.5, elbow_rotation=0.3)
    assert outwards * (inwards.translation() - bent)[1] < -0.02
    # The palm's normal is -x of the hand: backwards, and down when bent.
    palm = -_hand(scene, side, elbow_flexion=np.pi / 2).rotation().matrix()
    assert palm[:, 0] == pytest.approx([0, 0, -1], abs=1e-9)
    turned = -_hand(scene, side, wrist_supination=0.5).rotation().matrix()
    assert outwards * turned[1, 0] < -0.4


def test_trunk_and_neck_turn_left_and_forwards(scene):
    def eye(**angles):
        scene.reset()
        zero = dict.fromkeys(world.joint_names(scene.plant), 0.0)
        world.set_posture(scene.plant, scene.context, {**zero, **angles})
        frame = scene.plant.GetFrameByName("eye_camera")
        return frame.CalcPoseInWorld(scene.context)

    rest = eye()
    assert rest.translation() == pytest.approx([0.05, 0.0, 0.39])
    x, y, z = rest.rotation().matrix().T
    assert x == pytest.approx([0, -1, 0], abs=1e-6)  # right
    assert y[2] < 0  # down
    assert z[0] > 0.8  # forwards
    for name in ("waist_yaw", "neck_yaw"):
        assert eye(**{name: 0.3}).rotation().matrix()[1, 2] > 0.2
    for name in ("waist_pitch", "lumbar_pitch", "chest_pitch", "neck_pitch"):
        assert eye(**{name: 0.3}).rotation().matrix()[2, 2] < z[2] - 0.2
    for name in ("waist_roll", "neck_roll"):
        assert eye(**{name: 0.3}).translation()[1] < 0


def test_left_and_right_arms_are_mirror_images(scene):
    plant = scene.plant
    flip = np.array([1, -1, 1])
    for name, *_ in ARM:
        left, right = (
            world.get_joint(plant, f"{side}_{name}").child_body()
            for side in ("left", "right")
        )
        a, b = left.default_spatial_inertia(), right.default_spatial_inertia()
        assert a.get_mass() == b.get_mass()
        assert a.get_com() * flip == pytest.approx(b.get_com())
        assert a.CalcRotationalInertia().get_moments() == pytest.approx(
            b.CalcRotationalInertia().get_moments()
        )


def test_frames_of_the_contract(scene):
    for frame, body in (
        ("eye_camera", "affetto::head"),
        ("right_palm", "affetto::right_hand"),
        ("head_center", "drum::head"),
        ("marker", "drum::head"),
        ("mirror", "mirror::panel"),
    ):
        found = scene.plant.GetFrameByName(frame).body().scoped_name()
        assert str(found) == body
    X_WM = scene.plant.GetFrameByName("mirror").CalcPoseInWorld(scene.context)
    normal = X_WM.rotation().matrix()[:, 2]
    assert normal[1] < -0.8  # stands at the left, faces the robot's right
    assert normal[2] < -0.1  # leans forward: the drum's top is seen
    table = world.table_extents(scene.plant, scene.context)[1][2]
    assert table == pytest.approx(-0.03)
    head = world.head_center_position(scene.plant, scene.context)
    assert head[2] == pytest.approx(0.04)


def _material(scene, body, geometry):
    inspector = scene.scene_graph.model_inspector()
    model, name = body.split("::")
    plant = scene.plant
    frame = plant.GetBodyFrameIdOrThrow(
        plant.GetBodyByName(name, plant.GetModelInstanceByName(model)).index()
    )
    geometry_id = inspector.GetGeometryIdByName(
        frame, Role.kProximity, f"{model}::{geometry}"
    )
    properties = inspector.GetProximityProperties(geometry_id)
    return (
        properties.GetProperty("material", "point_contact_stiffness"),
        properties.GetProperty("material", "hunt_crossley_dissipation"),
    )


def test_materials(scene):
    hand, d = _material(scene, "affetto::right_hand", "rubber")
    skin, _ = _material(scene, "drum::head", "skin")
    assert 1 <= d <= 2
    assert hand * skin / (hand + skin) == pytest.approx(600, rel=0.02)
    inspector = scene.scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        properties = inspector.GetProximityProperties(geometry)
        for name in ("point_contact_stiffness", "hunt_crossley_dissipation"):
            assert properties.HasProperty("material", name)


def test_the_robot_does_not_collide_with_itself(scene):
    inspector = scene.scene_graph.model_inspector()
    robot = [
        geometry
        for geometry in inspector.GetAllGeometryIds(Role.kProximity)
        if inspector.GetName(geometry).startswith("affetto::")
    ]
    assert len(robot) > 2
    for i, a in enumerate(robot):
        for b in robot[i + 1 :]:
            assert inspector.CollisionFiltered(a, b)


def test_the_parser_has_nothing_to_warn_of(caplog):
    with caplog.at_level(logging.DEBUG, logger="drake"):
        plant = MultibodyPlant(0.001)
        world.add_world(plant, world.WorldConfig())
        plant.Finalize()
    heard = [r for r in caplog.records if r.levelno >= logging.WARNING]
    assert [record.getMessage() for record in heard] == []


def test_a_warning_of_the_parser_would_be_heard(caplog, tmp_path):
    path = tmp_path / "odd.sdf"
    path.write_text(
        "<sdf version='1.9'><model name='odd'><link name='a'><inertial>"
        "<mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>9</izz>"
        "</inertia></inertial></link></model></sdf>"
    )
    plant = MultibodyPlant(0.001)
    with caplog.at_level(logging.DEBUG, logger="drake"):
        Parser(plant).AddModels(str(path))
    assert any(r.levelno >= logging.WARNING for r in caplog.records)


@pytest.fixture(scope="module")
def meshes():
    path = ROOT / "tools" / "build_meshes.py"
    spec = importlib.util.spec_from_file_location("build_meshes", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_mesh_is_closed_and_faces_outwards(meshes):
    for name, build in meshes.MESHES.items():
        mesh = build()
        edges = {}
        volume = 0.0
        for face in mesh.faces:
            p = mesh.vertices[list(face)]
            for i in range(1, len(face) - 1):
                volume += p[0] @ np.cross(p[i], p[i + 1]) / 6
            for a, b in zip(face, (*face[1:], face[0]), strict=True):
                edges[a, b] = edges.get((a, b), 0) + 1
        # Each edge is walked once in either direction.
        assert set(edges.values()) == {1}, name
        assert all((b, a) in edges for a, b in edges), name
        assert volume > 0, name
        normals = np.linalg.norm(mesh.normals(), axis=1)
        assert normals == pytest.approx(1.0), name


def test_the_files_are_what_the_script_writes(meshes, tmp_path):
    folder = models_dir() / "meshes"
    assert {p.stem for p in folder.glob("*.obj")} == set(meshes.MESHES)
    total = 0
    for name, build in meshes.MESHES.items():
        build().write(tmp_path / "mesh.obj")
        stored = (folder / f"{name}.obj").read_text()
        total += len(stored)
        fresh = (tmp_path / "mesh.obj").read_text()
        assert _numbers(fresh) == pytest.approx(_numbers(stored), abs=2e-3)
    assert total < 1e6


def _numbers(obj: str) -> np.ndarray:
    words = obj.replace("//", " ").split()
    return np.array([float(w) for w in words if w not in ("v", "vn", "f")])


def test_every_mesh_is_used(scene, meshes):
    inspector = scene.scene_graph.model_inspector()
    used = {
        str(inspector.GetShape(i).source().path()).rsplit("/", 1)[-1]
        for i in inspector.GetAllGeometryIds(Role.kIllustration)
        if isinstance(inspector.GetShape(i), Mesh)
    }
    assert used == {f"{name}.obj" for name in meshes.MESHES}


def _renderers(model: str) -> dict[str, set[str]]:
    """Visual -> the renderers that its SDF names, none for all."""
    root = ElementTree.parse(models_dir() / f"sdf/{model}.sdf").getroot()
    tag = "{drake.mit.edu}accepting_renderer"
    return {
        visual.get("name"): {element.text for element in visual.iter(tag)}
        for visual in root.iter("visual")
    }


def test_what_stands_behind_the_mirror_is_hidden_from_the_mirror_pass():
    assert set(_renderers("mirror")) >= {"glass", "back"}
    behind = {**_renderers("mirror"), "": _renderers("room")["left_wall"]}
    for names in behind.values():
        assert "direct" in names
        assert "mirror" not in names


def test_the_camera_in_the_head_does_not_look_at_it_from_inside():
    names = _renderers("affetto")
    for part in ("face", "hair", "mouth", "left_eye", "right_pupil"):
        assert names[part] == {"mirror", "outside"}
    assert names["forearm"] == set()


def test_nothing_else_has_the_color_of_the_marker():
    """Green, the marker's color, is the marker's alone."""
    for path in (models_dir() / "sdf").glob("*.sdf"):
        for visual in ElementTree.parse(path).getroot().iter("visual"):
            rgb = [float(c) for c in visual.find(".//diffuse").text.split()[:3]]
            hue, saturation, _ = colorsys.rgb_to_hsv(*rgb)
            is_green = saturation > 0.35 and 0.2 < hue < 0.48
            assert is_green == (visual.get("name") == "marker")
