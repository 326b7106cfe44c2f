"""The simulated robot, which follows references with any gains."""

from collections.abc import Callable
import dataclasses
import math
from typing import Any

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.control.pidf import PidfGains
from drake_affetto.station.content import scenario_content
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.tuning.config import (
    TuningConfig,
    load_tuning,
)
from drake_affetto.tuning.costs import JointCosts, joint_costs
from drake_affetto.tuning.plan import TunePlan
from drake_affetto.tuning.references import (
    JointRange,
    Reference,
    joint_range,
    make_reference,
)


@dataclasses.dataclass(frozen=True)
class Rollout:
    """One simulation along a reference.

    Attributes:
        q: Angles at the reference's times, (T', n), rad; T' < T where the
            simulation was stopped.
        opening: Openings of the valves, (T', n), in -1 to 1.
    """

    q: Array
    opening: Array


class TrackingEnvironment:
    """The station as an environment for tracking references.

    It is built once; each rollout sets gains and reference in its context.

    Attributes:
        tuning: Configuration of references and costs.
        station: The AffettoStation.
        names: Names of the n joints.
        lower: Lower joint limits, (n,), rad.
        upper: Upper joint limits, (n,), rad.
        space: Range of the references.
    """

    def __init__(self, scenario: Scenario, tuning: TuningConfig):
        """Builds the station, whose input is `desired_state`.

        Args:
            scenario: The robot and its scene.
        """
        # Imported here, for the other modules import without Drake.
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder, TriggerType
        from pydrake.systems.primitives import (
            LogVectorOutput,
            TrajectorySource,
        )
        from pydrake.trajectories import PiecewisePolynomial

        from drake_affetto.station.station import AffettoStation

        self._polynomial = PiecewisePolynomial
        self.tuning = tuning
        scenario = dataclasses.replace(scenario, motion_source="external")
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem(
            "station", AffettoStation(scenario)
        )
        self.names = list(self.station.joints.names)
        n = self.station.num_joints
        self._source = builder.AddNamedSystem(
            "reference",
            TrajectorySource(PiecewisePolynomial(np.zeros((2 * n, 1)))),
        )
        builder.Connect(
            self._source.get_output_port(),
            self.station.GetInputPort("affetto.desired_state"),
        )
        self._logs = [
            LogVectorOutput(
                self.station.GetOutputPort(f"affetto.{name}"),
                builder,
                publish_triggers={TriggerType.kPeriodic},
                publish_period=1.0 / tuning.sample_rate,
            )
            for name in ("estimated_state", "valve_opening")
        ]
        self._simulator = Simulator(builder.Build())
        self._context = self._simulator.get_mutable_context()
        joints = self.station.joints
        self.lower, self.upper = joints.lower, joints.upper
        self.space: JointRange = joint_range(
            tuning,
            self.names,
            self.station.start_posture,
            self.lower,
            self.upper,
        )

    @property
    def span(self) -> Array:
        """Range of each joint, (n,), rad."""
        return self.upper - self.lower

    def reference(self, name: str) -> Reference:
        """The reference called `name`, for this robot."""
        return make_reference(name, self.tuning, self.space)

    def rollout(
        self,
        reference: Reference,
        gains: PidfGains,
        report: Callable[[float, Rollout], bool] | None = None,
        report_every: float = math.inf,
    ) -> Rollout:
        """Simulates the robot along `reference`, from rest.

        Args:
            reference: Reference to follow.
            gains: Gains of the n joints.
            report: Function of the time and the rollout so far, called while
                the simulation runs, which stops it by returning True.
            report_every: Time between two calls of `report`, s.
        """
        station, context = self.station, self._context
        desired = np.hstack([reference.q, reference.rate()]).T
        self._source.UpdateTrajectory(
            self._polynomial.FirstOrderHold(reference.t, desired)
        )
        context.SetTime(0.0)
        station_context = station.GetMyMutableContextFromRoot(context)
        station.reset(station_context)
        # The drum stands where no reference moves the hand.
        corners = station.scenario.drum_region.corners
        farthest = corners[np.argmax(corners.sum(axis=1))]
        station.set_drum_position(station_context, farthest)
        # Equilibrium: the integrators hold the start posture.
        controller = station.GetMutableSubsystemContext(
            station.controller, station_context
        )
        held = station.controller.get_pid_output_output_port().Eval(controller)
        station.controller.set_gains(controller, gains)
        station.controller.set_integral(controller, held)
        for log in self._logs:
            log.FindMutableLog(context).Clear()
        # Advance, with a report from time to time.
        self._simulator.Initialize()
        time = 0.0
        while time < reference.duration:
            time = min(time + report_every, reference.duration)
            self._simulator.AdvanceTo(time)
            if (
                report is not None
                and time < reference.duration
                and report(time, self._recording(reference))
            ):
                break
        return self._recording(reference)

    def _recording(self, reference: Reference) -> Rollout:
        state, opening = (self._read(log) for log in self._logs)
        count = min(len(state), len(opening), len(reference.t))
        return Rollout(state[:count, : len(self.names)], opening[:count])

    def _read(self, log) -> Array:
        data = log.FindLog(self._context)
        t = data.sample_times()
        # Times at which the simulator stopped are logged twice.
        keep = np.append(np.diff(t) > 1e-9, True)
        return data.data().T[keep].copy()

    def costs(self, reference: Reference, rollout: Rollout) -> JointCosts:
        """The costs of a rollout along `reference`.

        Args:
            rollout: What came of it.
        """
        return joint_costs(
            reference, rollout.q, rollout.opening, self.span, self.tuning.cost
        )


# The environments of this process by scenario and tuning file, each with the
# contents of both that it was built from.
_ENVIRONMENTS: dict[tuple[str, str], tuple[Any, TrackingEnvironment]] = {}


def environment(plan: TunePlan) -> TrackingEnvironment:
    """This process's environment of a plan.

    It is built at the first call, and again when a file has changed.

    Raises:
        InputError: If the scenario or the tuning file does not fit.
    """
    key = (plan.scenario, plan.tuning)
    tuning = load_tuning(plan.tuning)
    content = scenario_content(plan.scenario), repr(tuning)
    if key not in _ENVIRONMENTS or _ENVIRONMENTS[key][0] != content:
        built = TrackingEnvironment(load_scenario(plan.scenario), tuning)
        _ENVIRONMENTS[key] = content, built
    return _ENVIRONMENTS[key][1]


def run_reference(plan: TunePlan, name: str, gains: Array) -> Rollout:
    """Simulates one reference in this process.

    Args:
        plan: Plan of the study.
        name: Name of the reference.
        gains: Gains kP, kI, kD and kF of the n joints, (4, n).
    """
    robot = environment(plan)
    return robot.rollout(robot.reference(name), PidfGains.from_array(gains))
