"""The digest of all that determines a tuning study."""

import dataclasses

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.fingerprint import text_digest
from drake_affetto.control.pidf import load_control
from drake_affetto.control.pidf_controller import PidfConfig
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.station.content import content_of
from drake_affetto.tuning.environment import environment
from drake_affetto.tuning.plan import TunePlan


def fingerprint(plan: TunePlan) -> str:
    """The digest of all that determines a trial: a study holds one kind.

    It is stored in the study. The digest is that of a `repr`, so that names
    and fields of the classes below must stay as they are for a stored study
    to continue.

    Raises:
        InputError: If a file of the plan does not fit.
    """
    robot = environment(plan)
    scenario = robot.station.scenario
    actuators = load_parameters(
        scenario.pneumatics.parameters, tuple(scenario.pneumatics.overlays)
    )
    control = load_control(
        scenario.control.parameters, tuple(scenario.control.overlays)
    )
    # The scenario's own gains do not count: a trial sets all of them.
    limits = dataclasses.replace(control, gains={})
    rest, _ = content_of(
        dataclasses.replace(
            scenario,
            control=PidfConfig(
                parameters=limits,
                period=scenario.control.period,
                gravity_share=scenario.control.gravity_share,
            ),
        )
    )
    parts = (
        __version__,
        plan.joints,
        plan.seed,
        robot.names,
        robot.tuning,
        load_control(plan.start).for_joints(robot.names),
        limits,
        scenario.control.period,
        scenario.plant_config.time_step,
        actuators,
        np.stack([robot.space.start, robot.lower, robot.upper]).tolist(),
        rest,
    )
    return text_digest(repr(parts))
