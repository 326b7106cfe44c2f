"""The robot, simulated while it follows references."""

from collections.abc import Callable
import dataclasses
import math

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.control.pidf import (
    PidfGains,
)
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
from drake_affetto.tuning.results import Rollout


class TrackingEnvironment:
    """The robot, following references under any gains.

    The station is built once; gains and references are its context's.
    """

    def __init__(self, scenario: Scenario, tuning: TuningConfig):
        """Builds the station with `desired_state` as its input."""
        # Drake is loaded where it is needed: the command's help is not.
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder, TriggerType
        from pydrake.systems.primitives import (
            LogVectorOutput,
            TrajectorySource,
        )
        from pydrake.trajectories import PiecewisePolynomial

        from drake_affetto.scene.world import joint_limits
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
        self.lower, self.upper = joint_limits(self.station.plant, self.names)
        self.space: JointRange = joint_range(
            tuning,
            self.names,
            self.station.start_posture,
            self.lower,
            self.upper,
        )

    @property
    def span(self) -> Array:
        """(n,) range of each joint, rad."""
        return self.upper - self.lower

    def reference(self, name: str) -> Reference:
        """The reference called `name`, for this robot."""
        return make_reference(name, self.tuning, self.space)

    def run(
        self,
        reference: Reference,
        gains: PidfGains,
        report: Callable[[float, Rollout], bool] | None = None,
        report_every: float = math.inf,
    ) -> Rollout:
        """Follows `reference` from rest at the start posture.

        Args:
            report: called on the way with the time and what there is so far;
                the run stops where it returns True.
            report_every: s.
        """
        station, context = self.station, self._context
        desired = np.hstack([reference.q, reference.rate()]).T
        self._source.UpdateTrajectory(
            self._polynomial.FirstOrderHold(reference.t, desired)
        )
        context.SetTime(0.0)
        mine = station.GetMyMutableContextFromRoot(context)
        station.reset(mine)
        # Where no reference leads the hand.
        region = station.scenario.drum_region
        station.set_drum_position(mine, [region.x[1], region.y[1]])
        controller = station.GetMutableSubsystemContext(
            station.controller, mine
        )
        held = station.controller.get_pid_output_output_port().Eval(controller)
        station.controller.set_gains(controller, gains)
        station.controller.set_integral(controller, held)
        for log in self._logs:
            log.FindMutableLog(context).Clear()
        self._simulator.Initialize()
        time = 0.0
        while time < reference.duration:
            time = min(time + report_every, reference.duration)
            self._simulator.AdvanceTo(time)
            if (
                report is not None
                and time < reference.duration
                and report(time, self._recorded(reference))
            ):
                break
        return self._recorded(reference)

    def _recorded(self, reference: Reference) -> Rollout:
        state, opening = (self._read(log) for log in self._logs)
        count = min(len(state), len(opening), len(reference.t))
        return Rollout(state[:count, : len(self.names)], opening[:count])

    def _read(self, log) -> Array:
        data = log.FindLog(self._context)
        t = data.sample_times()
        # A time at which the simulator stopped is logged twice.
        keep = np.append(np.diff(t) > 1e-9, True)
        return data.data().T[keep].copy()

    def costs(self, reference: Reference, run: Rollout) -> JointCosts:
        """What `run` along `reference` has cost."""
        return joint_costs(
            reference, run.q, run.opening, self.span, self.tuning.cost
        )


# One bench for each process and plan.
_ENVIRONMENTS: dict[tuple[str, str], TrackingEnvironment] = {}


def environment(plan: TunePlan) -> TrackingEnvironment:
    """This process's bench, built when first asked for."""
    key = (plan.scenario, plan.tuning)
    if key not in _ENVIRONMENTS:
        _ENVIRONMENTS[key] = TrackingEnvironment(
            load_scenario(plan.scenario), load_tuning(plan.tuning)
        )
    return _ENVIRONMENTS[key]


def run_reference(plan: TunePlan, name: str, gains: Array) -> Rollout:
    """Follows the reference `name` with `gains` (4, n), in this process."""
    robot = environment(plan)
    return robot.run(robot.reference(name), PidfGains.from_array(gains))


@dataclasses.dataclass(frozen=True)
class Rollout:
    """One run along a reference.

    Attributes:
        q: (T', n) angles at the reference's times, rad; T' < T where the run
            was stopped.
        opening: (T', n) of the valves.
    """

    q: Array
    opening: Array
