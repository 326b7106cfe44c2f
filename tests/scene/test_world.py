"""Drum placement, postures, joint selection, and errors that name things."""

from pathlib import Path

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.scene import world
from support.drumming_scene import build_scene

ACTIVE = list(world.ACTIVE_JOINTS)


def test_the_drum_stands_where_it_is_put(scene):
    default = world.get_drum_position(scene.plant, scene.context)
    assert default == pytest.approx(world.WorldConfig().drum_position)
    for xy in ([0.2, -0.15], [0.3, 0.0]):
        world.set_drum_position(scene.plant, scene.context, xy)
        assert world.get_drum_position(
            scene.plant, scene.context
        ) == pytest.approx(xy)
        marker = world.marker_position(scene.plant, scene.context)
        assert marker == pytest.approx([*xy, 0.041])
        # The model stands on the table, neither in it nor above it.
        shell = scene.plant.GetFrameByName("shell")
        foot = shell.CalcPoseInWorld(scene.context).translation()
        top = world.table_extents(scene.plant, scene.context)[1][2]
        assert foot == pytest.approx([*xy, top])


def test_a_new_context_does_not_remember_the_drum(scene):
    world.set_drum_position(scene.plant, scene.context, [0.3, 0.0])
    other = scene.plant.GetMyContextFromRoot(
        scene.diagram.CreateDefaultContext()
    )
    assert world.get_drum_position(scene.plant, other) == pytest.approx(
        world.WorldConfig().drum_position
    )


@pytest.mark.parametrize(
    ("xy", "told"),
    [
        ([0.1, 0.0], r"0\.1, 0\.0.*x from 0\.129"),
        ([0.3, 0.45], "wholly on the table"),
        ([0.3], r"of shape \(1,\), expected the shape \(2,\)"),
        ([0.3, np.nan], r"drum position\[1\] is nan"),
    ],
)
def test_a_drum_that_would_fall_is_refused(scene, xy, told):
    before = world.get_drum_position(scene.plant, scene.context)
    with pytest.raises(InputError, match=told):
        world.set_drum_position(scene.plant, scene.context, xy)
    after = world.get_drum_position(scene.plant, scene.context)
    assert np.all(after == before)


def test_the_limits_of_the_drum_are_just_on_the_table(scene):
    low, high = world.drum_limits(scene.plant, scene.context)
    lower, upper = world.table_extents(scene.plant, scene.context)
    radius = world.drum_radius(scene.plant, scene.context)
    assert low - radius == pytest.approx(lower[:2])
    assert high + radius == pytest.approx(upper[:2])
    for corner in (low, high):
        world.set_drum_position(scene.plant, scene.context, corner)


def test_sizes_are_read_from_the_models(scene):
    assert world.marker_radius(scene.plant, scene.context) == 0.030
    assert world.hand_radius(scene.plant, scene.context) == 0.028
    size = world.mirror_size(scene.plant, scene.context)
    assert size == pytest.approx([0.50, 0.38])


def test_the_palm_hovers_at_the_start(scene):
    palm = scene.plant.GetFrameByName("right_palm")
    X_WP = palm.CalcPoseInWorld(scene.context)
    head = world.head_center_position(scene.plant, scene.context)
    hand = world.hand_radius(scene.plant, scene.context)
    assert X_WP.translation()[2] - hand - head[2] >= 0.07
    assert X_WP.rotation().matrix()[2, 2] < -0.85  # palm down
    away = np.linalg.norm(X_WP.translation()[:2] - head[:2])
    assert away < 0.15


def test_postures_are_set_and_read_back(scene):
    posture = {"waist_yaw": 0.2, "left_elbow_flexion": 1.0}
    joint = world.get_joint(scene.plant, "waist_yaw")
    joint.set_angular_rate(scene.context, 3.0)
    before = world.get_posture(scene.plant, scene.context)
    world.set_posture(scene.plant, scene.context, posture)
    after = world.get_posture(scene.plant, scene.context)
    assert after == {**before, **posture}
    assert joint.get_angular_rate(scene.context) == 0.0


@pytest.mark.parametrize(
    ("posture", "told"),
    [
        ({"waist_jaw": 0.1}, "no joint 'waist_jaw'; did you mean waist_yaw"),
        ({"waist_yaw": 0.9}, r"posture\.waist_yaw is 0\.9.*-0\.78.* to 0\.78"),
        ({"waist_yaw": float("nan")}, r"posture\.waist_yaw is nan"),
    ],
)
def test_bad_postures_are_refused_as_a_whole(scene, posture, told):
    before = world.get_posture(scene.plant, scene.context)
    with pytest.raises(InputError, match=told):
        world.set_posture(
            scene.plant, scene.context, {"neck_yaw": 0.5, **posture}
        )
    assert world.get_posture(scene.plant, scene.context) == before


def test_inactive_joints_are_welded_where_they_stand():
    plant, others = (
        MultibodyPlant(time_step=0.001),
        {"neck_yaw": 0.4, "right_wrist_flexion": -0.2},
    )
    config = world.WorldConfig(
        default_posture={**others, "right_elbow_flexion": 1.5}
    )
    world.add_world(plant, config)
    full = MultibodyPlant(time_step=0.001)
    world.add_world(full, config)
    full.Finalize()
    with pytest.raises(InputError, match="no joint 'elbow'"):
        world.weld_inactive(plant, ["elbow"])
    world.weld_inactive(plant, ACTIVE)
    plant.Finalize()
    assert sorted(world.joint_names(plant)) == sorted(ACTIVE)
    assert plant.num_positions() == plant.num_actuators() == len(ACTIVE)
    # The same body: every link stands where it does with all joints.
    a, b = plant.CreateDefaultContext(), full.CreateDefaultContext()
    for context, each in ((a, plant), (b, full)):
        world.set_posture(each, context, {"waist_yaw": 0.2})
    robot = full.GetModelInstanceByName("affetto")
    for index in full.GetBodyIndices(robot):
        body = full.get_body(index)
        twin = plant.GetBodyByName(
            body.name(), plant.GetModelInstanceByName("affetto")
        )
        X_a, X_b = twin.EvalPoseInWorld(a), body.EvalPoseInWorld(b)
        assert X_a.IsNearlyEqualTo(X_b, 1e-12), body.name()
    assert plant.CalcTotalMass(a) == pytest.approx(full.CalcTotalMass(b))


def test_limits_in_the_order_of_the_names(scene):
    low, high = world.joint_limits(
        scene.plant, ["right_elbow_flexion", "waist_yaw"]
    )
    assert np.degrees(low) == pytest.approx([0, -45], abs=1e-3)
    assert np.degrees(high) == pytest.approx([130, 45], abs=1e-3)
    effort = world.effort_limits(scene.plant, ["right_elbow_flexion"])
    assert effort == pytest.approx([3.0])


def test_a_default_posture_replaces_the_scene_s(scene):
    plant = MultibodyPlant(0.001)
    posture = {"neck_yaw": 0.72}
    world.add_world(plant, world.WorldConfig(default_posture=posture))
    plant.Finalize()
    usual = world.get_posture(scene.plant, scene.context)
    found = world.get_posture(plant, plant.CreateDefaultContext())
    assert found == {**usual, **posture}
    assert usual["neck_yaw"] != 0.72


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ({"drum": "package://drake_affetto/sdf/tabla.sdf"}, "drum.*tabla.sdf"),
        ({"directives": "nowhere.dmd.yaml"}, "directives.*nowhere.dmd.yaml"),
        ({"drum_position": [0.2]}, r"drum_position is \[0\.2\]"),
        ({"drum_position": [0.2, 99.0]}, r"drum_position\[1\] is 99"),
        ({"default_posture": {"neck_yaw": 9.0}}, r"default_posture\.neck_yaw"),
        ({"default_posture": {"neck": 0.1}}, "no joint 'neck'"),
    ],
)
def test_a_world_that_does_not_fit_is_told_in_one_line(config, told):
    plant = MultibodyPlant(0.001)
    with pytest.raises(InputError, match=told) as error:
        world.add_world(plant, world.WorldConfig(**config))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("field", "name", "text", "told"),
    [
        (
            "drum",
            "tabor.sdf",
            "<sdf version='1.9'><model name='tabor'><link name='shell'/>"
            "</model></sdf>",
            "models in .*tabor.sdf is .'tabor'., expected one, named drum",
        ),
        (
            "drum",
            "drum.sdf",
            "<sdf version='1.9'><model name='drum'><link name='shell'/>"
            "<link name='head'/></model></sdf>",
            "drum.sdf has no frame 'drum::head_center'",
        ),
        (
            "drum",
            "empty.sdf",
            "<sdf version='1.9'><model name='drum'/></sdf>",
            "empty.sdf",
        ),
        (
            "drum",
            "broken.sdf",
            "<sdf version='1.9'><model name='x'><link>",
            "cannot read .*broken.sdf: .*XML",
        ),
        (
            "directives",
            "empty.dmd.yaml",
            "directives: []",
            "empty.dmd.yaml has no frame 'affetto::pelvis'",
        ),
        (
            "directives",
            "twice.dmd.yaml",
            "directives: []\ndirectives: []",
            "twice.dmd.yaml: directives is given twice, in lines 1 and 2",
        ),
        (
            "directives",
            "lost.dmd.yaml",
            "directives: [{add_model: {name: a, file: package://lost/a.sdf}}]",
            "cannot read .*lost.dmd.yaml: .*lost",
        ),
        (
            "directives",
            "odd.dmd.yaml",
            "directives: [{add_modell: {}}]",
            "cannot read .*odd.dmd.yaml: .*add_modell",
        ),
    ],
)
def test_files_that_do_not_fit_are_told_in_one_line(
    tmp_path, field, name, text, told
):
    path = tmp_path / name
    path.write_text(text)
    plant = MultibodyPlant(0.001)
    with pytest.raises(InputError, match=told) as error:
        world.add_world(plant, world.WorldConfig(**{field: str(path)}))
    assert "\n" not in str(error.value)


def write_changed(tmp_path, name: str, *changes: tuple[str, str]) -> str:
    """A copy of a file of the models, with texts replaced; its path."""
    text = (models_dir() / name).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / Path(name).name
    path.write_text(text)
    return str(path)


STATIC = ('<model name="drum">', '<model name="drum"><static>true</static>')
WELD = ("    child: affetto::pelvis", "    child: affetto::lumbar_pitch_link")


def test_a_drum_that_is_static_is_refused(tmp_path):
    drum = write_changed(tmp_path, "sdf/drum.sdf", STATIC)
    with pytest.raises(InputError, match=r"drum\.sdf: drum::shell is static"):
        world.add_world(MultibodyPlant(0.001), world.WorldConfig(drum=drum))


def test_a_drum_of_loose_parts_is_refused(tmp_path):
    drum = write_changed(
        tmp_path,
        "sdf/drum.sdf",
        ("</model>", '<link name="stick"/></model>'),
    )
    with pytest.raises(InputError, match=r"drum::stick is not fixed to drum::"):
        world.add_world(MultibodyPlant(0.001), world.WorldConfig(drum=drum))


def test_a_robot_that_is_welded_elsewhere_is_refused(tmp_path):
    directives = write_changed(tmp_path, "scenes/drumming.dmd.yaml", WELD)
    config = world.WorldConfig(directives=directives)
    with pytest.raises(InputError, match=r"affetto::pelvis is not welded"):
        world.add_world(MultibodyPlant(0.001), config)


def test_another_model_may_have_parts_of_the_same_names(tmp_path, scene):
    """A second table, with bodies and frames called as the scene's own."""
    other = tmp_path / "other.sdf"
    links = "".join(
        f"<link name='{name}'/>"
        for name in ("table_top", "shell", "right_hand", "right_palm", "mirror")
    )
    frames = "".join(
        f"<frame name='{name}' attached_to='shell'/>"
        for name in ("marker", "head_center", "eye_camera")
    )
    other.write_text(
        f"<sdf version='1.9'><model name='other'><static>true</static>{links}"
        f"{frames}</model></sdf>"
    )
    directives = write_changed(
        tmp_path,
        "scenes/drumming.dmd.yaml",
        (
            "directives:\n",
            f"directives:\n- add_model: {{name: other, file: file://{other}}}\n",
        ),
    )
    built = build_scene(0.001, world.WorldConfig(directives=directives))
    for measure in (
        world.table_extents,
        world.drum_radius,
        world.head_radius,
        world.hand_radius,
        world.marker_radius,
        world.mirror_size,
        world.marker_position,
        world.head_center_position,
    ):
        np.testing.assert_allclose(
            measure(built.plant, built.context),
            measure(scene.plant, scene.context),
        )
