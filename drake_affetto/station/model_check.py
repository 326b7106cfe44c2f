"""Checks of a scenario against its models, without rendering anything.

`check_models` builds a plant for that, which takes a fifth of a second.
"""

import os
from typing import Protocol

from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_affetto.common.errors import InputError, naming, require
from drake_affetto.common.fingerprint import config_values, text_digest
from drake_affetto.common.nested import leaves
from drake_affetto.common.resources import resolve
from drake_affetto.control.pidf_controller import PidfConfig
from drake_affetto.perception.config import CameraConfig, MirrorConfig
from drake_affetto.perception.mirror_camera import MirrorCamera
from drake_affetto.pneumatics.actuation import PneumaticActuationConfig
from drake_affetto.pneumatics.driver import AddPneumaticDriver, PneumaticDriver
from drake_affetto.pneumatics.parameters import JointActuator
from drake_affetto.scene import world
from drake_affetto.scene.damping import set_joint_damping
from drake_affetto.station.drum_region import DrumRegion


class ModelScenario(Protocol):
    """What of a scenario its models have to fit; see `Scenario`."""

    plant_config: MultibodyPlantConfig
    world: world.WorldConfig
    active_joints: list[str]
    joint_damping: dict[str, float]
    yaw_joint: str
    drum_region: DrumRegion
    camera: CameraConfig
    mirrors: list[MirrorConfig]
    control: PidfConfig
    pneumatics: PneumaticActuationConfig
    valve_source: str


# How upright the axis of a yaw joint is at least: the z of its direction.
_UPRIGHT = 0.7

# What has been found to fit in this process.
_FITTING: set[str] = set()


def check_models_once(scenario: ModelScenario, where: str) -> None:
    """As `check_models`, but at once where the same has been found to fit.

    The same are the values that models have to fit, and the files that they
    name as far as their times and sizes tell. A model that one of those files
    includes may have changed: whoever builds the station finds out then.
    """
    values = config_values(
        {
            name: getattr(scenario, name)
            for name in ModelScenario.__annotations__
        }
    )
    files = [
        (leaf, stat.st_mtime_ns, stat.st_size)
        for leaf in leaves(values)
        if isinstance(leaf, str) and (stat := _stat(leaf)) is not None
    ]
    key = text_digest(repr((values, files)))
    if key not in _FITTING:
        check_models(scenario, where)
        _FITTING.add(key)


def _stat(leaf: str) -> os.stat_result | None:
    """Of the file that a value of a scenario names; None if it names none."""
    if "." not in leaf:
        return None
    try:
        return resolve(leaf).stat()
    except InputError:
        return None


def check_models(scenario: ModelScenario, where: str) -> None:
    """Checks all that can be checked without a camera's renderer.

    Args:
        scenario: ModelScenario, checked by itself already.
        where: Its name in errors.

    Raises:
        InputError: For a model, a joint, a frame or a place that does not
            fit, by field and value.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant_config, builder)
    with naming(where):
        world.add_world(plant, scenario.world)
    with naming(f"{where}.active_joints"):
        world.weld_inactive(plant, scenario.active_joints)
    with naming(where):
        set_joint_damping(plant, scenario.joint_damping)
    with naming(f"{where}.world"):
        try:
            plant.Finalize()
        except RuntimeError as error:
            raise InputError(str(error)) from error
    controlled = scenario.valve_source == "pidf"
    for part in ("pneumatics", "control"):
        config = getattr(scenario, part)
        if isinstance(config.parameters, str):
            with naming(f"{where}.{part}.parameters"):
                resolve(config.parameters)
        for i, overlay in enumerate(config.overlays):
            with naming(f"{where}.{part}.overlays[{i}]"):
                resolve(overlay)
    with naming(where):
        AddPneumaticDriver(
            PneumaticDriver(
                joints={
                    name: JointActuator() for name in scenario.active_joints
                },
                pneumatics=scenario.pneumatics,
                control=scenario.control if controlled else None,
            ),
            plant,
            world.robot_instance(plant),
            builder,
        )
        camera = MirrorCamera(plant, scenario.camera, scenario.mirrors)
    builder.AddNamedSystem("camera", camera)
    builder.Connect(
        scene_graph.get_query_output_port(),
        camera.get_query_object_input_port(),
    )
    check_scene(builder.Build(), plant, camera, scenario, where)


def check_scene(
    diagram: Diagram,
    plant: MultibodyPlant,
    camera: MirrorCamera,
    scenario: ModelScenario,
    where: str,
) -> None:
    """Checks a scenario against the plant that was built from it.

    Args:
        diagram: Diagram of plant, scene and camera.
        plant: Finalized plant in it.
        camera: Camera in it.
        scenario: Scenario that they were built from.
        where: Its name in errors.

    Raises:
        InputError: For a place off the table, a yaw joint that does not turn
            the camera, or a mirror without a size.
    """
    root = Diagram.CreateDefaultContext(diagram)
    context = plant.GetMyContextFromRoot(root)
    region = scenario.drum_region
    field = f"{where}.drum_region" + (".polygon" if region.polygon else "")
    world.require_on_table(plant, context, field, *region.corners)
    chain = world.serial_chain(plant, scenario.camera.frame)
    name = scenario.yaw_joint
    expected = "an active joint that turns the camera about a vertical axis"
    require(name in chain.names, f"{where}.yaw_joint", name, expected)
    joint = world.get_joint(plant, name)
    R_WJ = joint.frame_on_parent().CalcPoseInWorld(context).rotation()
    axis = R_WJ.matrix() @ joint.revolute_axis()
    require(abs(axis[2]) > _UPRIGHT, f"{where}.yaw_joint", name, expected)
    with naming(where):
        camera.mirrors(camera.GetMyContextFromRoot(root))
