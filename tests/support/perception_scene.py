"""A small scene for the tests of perception: a camera on a yaw joint.

The camera looks down at a table with a disc marker on a movable stand; a
mirror leans at the side, and a rod on a joint can be put in the way.
"""

from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import FixedOffsetFrame

MARKER_RADIUS = 0.025
MARKER_COLOR = [0.85, 0.10, 0.45]
_MARKER_RGB = " ".join(map(str, MARKER_COLOR))
MIRROR_SIZE = (0.42, 0.36)
CAMERA_SDF = """
<sdf version='1.8'><model name='robot'>
  <link name='base'/>
  <link name='torso'>
    <inertial><mass>2</mass><inertia><ixx>.02</ixx><iyy>.02</iyy>
    <izz>.02</izz></inertia></inertial>
    <visual name='chest'><pose>-.02 0 -.08 0 0 0</pose><geometry><box>
    <size>.05 .12 .2</size></box></geometry>
    <material><diffuse>.8 .7 .6 1</diffuse></material></visual>
  </link>
  <joint name='yaw' type='revolute'><parent>base</parent><child>torso</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-.6</lower><upper>.6</upper>
    <effort>50</effort></limit></axis></joint>
  <frame name='eye_camera' attached_to='torso'>
    <pose rotation_format='quat_xyzw' >.05 0 0.08 0 0 0 1</pose></frame>
  <link name='rod'>
    <inertial><mass>.1</mass><inertia><ixx>.001</ixx><iyy>.001</iyy>
    <izz>.001</izz></inertia></inertial>
    <visual name='rod'><pose>.16 0 0 0 1.5708 0</pose><geometry><cylinder>
    <radius>.012</radius><length>.3</length></cylinder></geometry>
    <material><diffuse>.7 .7 .2 1</diffuse></material></visual>
  </link>
  <joint name='rod_yaw' type='revolute'><pose relative_to='base'>
    .04 0 -.05 0 0 0</pose><parent>torso</parent>
    <child>rod</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""
DRUM_SDF = f"""
<sdf version='1.8'><model name='drum'><link name='shell'>
  <visual name='shell'><pose>0 0 .035 0 0 0</pose><geometry><cylinder>
    <radius>.065</radius><length>.07</length></cylinder></geometry>
    <material><diffuse>.85 .85 .8 1</diffuse></material></visual>
  <visual name='marker'><pose>0 0 .0703 0 0 0</pose><geometry><cylinder>
    <radius>{MARKER_RADIUS}</radius><length>.0006</length></cylinder></geometry>
    <material><diffuse>{_MARKER_RGB} 1</diffuse></material></visual>
  </link><frame name='marker' attached_to='shell'><pose>0 0 .0706 0 0 0</pose>
  </frame></model></sdf>"""
TABLE_SDF = """
<sdf version='1.8'><model name='table'><static>true</static>
 <link name='table_top'>
  <visual name='top'><pose>.25 0 -.02 0 0 0</pose><geometry><box>
  <size>.8 1.2 .04</size></box></geometry>
  <material><diffuse>.55 .45 .35 1</diffuse></material></visual>
</link></model></sdf>"""
MIRROR_SDF = f"""
<sdf version='1.8'><model name='mirror'><link name='panel'>
  <visual name='panel'><pose>0 0 -.0025 0 0 0</pose><geometry><box>
    <size>{MIRROR_SIZE[0]} {MIRROR_SIZE[1]} .005</size></box></geometry>
    <material><diffuse>.2 .2 .25 1</diffuse></material>
    <drake:accepting_renderer>direct</drake:accepting_renderer></visual>
  </link><frame name='mirror' attached_to='panel'/></model></sdf>"""
SDF_HEAD = "<sdf version='1.8'>"


def add_scene(builder, time_step=0.001, n_mirrors=1):
    """Adds plant and scene; returns (plant, scene_graph)."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
    parser = Parser(plant)
    for text in (CAMERA_SDF, DRUM_SDF, TABLE_SDF):
        parser.AddModelsFromString(_namespaced(text), "sdf")
    plant.WeldFrames(
        plant.world_frame(),
        plant.GetFrameByName("base"),
        RigidTransform([0.0, 0.0, 0.3]),
    )
    placement = plant.AddFrame(
        FixedOffsetFrame(
            "drum_placement", plant.world_frame(), RigidTransform([0.3, 0, 0])
        )
    )
    plant.WeldFrames(placement, plant.GetFrameByName("shell"))
    # The camera's frame: z forward and down, x right, y down.
    plant.AddFrame(
        FixedOffsetFrame(
            "camera",
            plant.GetFrameByName("eye_camera"),
            camera_pose(0.75),
        )
    )
    for index in range(n_mirrors):
        side = -1.0 if index == 0 else 1.0
        (panel,) = parser.AddModelsFromString(
            _namespaced(
                MIRROR_SDF.replace("'mirror'>", f"'mirror{index}'>", 1)
            ),
            "sdf",
        )
        pose = plant.AddFrame(
            FixedOffsetFrame(
                f"mirror_pose{index}",
                plant.world_frame(),
                mirror_pose(side),
            )
        )
        plant.WeldFrames(pose, plant.GetFrameByName("panel", panel))
    plant.Finalize()
    return plant, scene_graph


def _namespaced(text):
    """Declares Drake's own element names."""
    return text.replace(
        SDF_HEAD, "<sdf xmlns:drake='drake.mit.edu' version='1.8'>"
    ).strip()


def camera_pose(pitch_down):
    """X_BC of a camera that looks forward and `pitch_down` below it."""
    R = RollPitchYaw(-1.5707963267948966 - pitch_down, 0, -1.5707963267948966)
    return RigidTransform(R, [0, 0, 0])


def mirror_pose(side=-1.0, lean=0.15, y=0.24, x=0.25, z=0.18):
    """X_WM: the panel at `side` of the table, leaning towards it.

    Its normal points across the table and down by `lean`.
    """
    # Panel x along the world's x, +z towards the table, then leaned forward.
    R = RollPitchYaw(side * (1.5707963267948966 + lean), 0, 0)
    return RigidTransform(R, [x, side * y, z])
