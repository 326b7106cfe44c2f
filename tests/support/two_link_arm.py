"""The planar arm of the models, on pneumatic actuators."""

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.common.resources import models_dir
from drake_affetto.control.pidf import ControlParameters, JointGains
from drake_affetto.control.pidf_controller import PidfConfig
from drake_affetto.pneumatics.driver import (
    ApplyPneumaticDriver,
    PneumaticDriver,
)
from drake_affetto.pneumatics.parameters import JointActuator

FILE = str(models_dir() / "sdf/two_link_arm.sdf")
GAINS = JointGains(kP=1e6, kI=1.5e6, kD=4e4, kF=4e-6)


def add_plant(builder, time_step=0.001, models=1):
    """The plant, and the instances of its arms."""
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    arms = [parser.AddModels(FILE)[0] for _ in range(models)]
    plant.Finalize()
    return plant, arms


def driver(*, control=True, override=None, **fields):
    """A driver of both joints, of Affetto's classes, with gains by class."""
    gains = {"shoulder": GAINS, "elbow": GAINS}
    parameters = ControlParameters(gains=gains)
    return PneumaticDriver(
        joints={
            name: JointActuator(name, dict(override or {}))
            for name in ("shoulder", "elbow")
        },
        control=PidfConfig(parameters) if control else None,
        **fields,
    )


def build(config, time_step=0.001):
    """The diagram of an arm with that driver, and the driver's systems."""
    builder = DiagramBuilder()
    plant, (arm,) = add_plant(builder, time_step)
    systems = ApplyPneumaticDriver(config, plant, arm, builder)
    return builder.Build(), systems
