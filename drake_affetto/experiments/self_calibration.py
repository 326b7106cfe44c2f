"""The robot finds a mirror by itself, and drums by it (no demonstration).

Each repeat has a mirror of its own and a robot whose model of itself is wrong
in its own way. The robot looks at its hand in the mirror, or at the drum's
marker, or only strikes and listens; then it drums at unseen positions. What
decides next, in `drake_affetto.calibration`, is given joint readings, pixels
and whether a stroke was heard; the true mirror is in the trials' specs alone.
"""

from collections.abc import Callable, Mapping, Sequence
import dataclasses
from typing import Any

import numpy as np

from drake_affetto.calibration.belief import PlaneBelief
from drake_affetto.calibration.config import (
    SelfCalibrationConfig,
    load_self_calibration,
)
from drake_affetto.calibration.ellipse import (
    EllipseLook,
    estimate_from_ellipses,
)
from drake_affetto.calibration.hand import HandLook
from drake_affetto.calibration.knowledge import RobotKnowledge
from drake_affetto.calibration.plane import CalibrationFailure, PlaneEstimate
from drake_affetto.calibration.postures import HandCalibration
from drake_affetto.common.typing import Array
from drake_affetto.experiments.bodies import Robots
from drake_affetto.experiments.drumming import HIDDEN, SOURCE
from drake_affetto.experiments.mirror_setup import MirrorSetup
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.results import (
    EllipseLookResult,
    GazeResult,
    HandLookResult,
    StrikeResult,
)
from drake_affetto.experiments.skills import (
    learn_skill,
    run_strikes,
    stack_prototypes,
    strike_if_seen,
    teach_positions,
)
from drake_affetto.experiments.trials import (
    at_mirror,
    draw_positions,
    ellipse_look,
    hand_look,
    look,
    run_trials,
    trial_seed,
)
from drake_affetto.runner.executor import Spec, TrialExecutor
from drake_affetto.scene.world import FramePose
from drake_affetto.station.scenario import load_scenario

# What the seeds of this study are for; the skill's are those of the drum study.
_MIRROR, _ERRORS, _TESTS, _TRIALS, _HAND, _PLACES, _EAR, _TURN = range(200, 208)

# Planes in a picture of what is believed.
PICTURED = 40


@dataclasses.dataclass
class Repeat:
    """One mirror, and the robot before it.

    Attributes:
        number: Number of the repeat.
        scenario: Scenario of its view with the mirror.
        mirror: The true mirror; for trials and judges only.
        turned: The same, turned by somebody in between.
        known: The robot's model of itself, which is a little wrong.
        skill: Skill, learned in direct view.
        prototypes: Prototypes of the reward (N, bands, frames).
        positions: Unseen positions of the drum (evaluations, 2), m.
    """

    number: int
    scenario: str
    mirror: FramePose
    turned: FramePose
    known: RobotKnowledge
    skill: Any
    prototypes: np.ndarray
    positions: np.ndarray


@dataclasses.dataclass(frozen=True)
class Drum:
    """A drum before a mirror, in one trial.

    Attributes:
        repeat: Repeat to which it belongs.
        mirror: Where the mirror is then.
        xy: Position of the drum (2,), m.
        seed: Seed of the trial.
    """

    repeat: Repeat
    mirror: FramePose
    xy: Any
    seed: int


@dataclasses.dataclass
class Calibrated:
    """What a way of finding the mirror came to in one repeat.

    Attributes:
        plane: The believed plane; None if nothing was found.
        known: The robot's model of itself, corrected.
        to_direct: The task parameters (N, 2) of the direct view for those
            (N, 2) of the mirror's view.
        looks: Number of looks.
        strokes: Number of own strokes.
        failure: What was missing.
        steps: Planes that were believed after so many looks or strokes.
        seen: Looks at the hand that agree on the plane.
    """

    plane: PlaneEstimate | None
    known: RobotKnowledge
    to_direct: Callable[[Array], Array] | None
    looks: int = 0
    strokes: int = 0
    failure: str | None = None
    steps: list[tuple[int, Array]] = dataclasses.field(default_factory=list)
    seen: list[HandLook] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class MirroredSkill:
    """The skill, asked with what is seen in the mirror.

    Attributes:
        skill: Regressor from the direct view's task parameters.
        to_direct: From the mirror's task parameters to these.
    """

    skill: Any
    to_direct: Callable[[Array], Array]

    def predict(self, tau: Any) -> np.ndarray:
        """θ (N, F) for τ̂ (N, 2)."""
        return self.skill.predict(self.to_direct(np.asarray(tau, float)))


class SelfCalibration:
    """The trials and the robot's decisions in some repeats of a study."""

    def __init__(
        self,
        executor: TrialExecutor,
        plan: SelfCalibrationPlan,
        numbers: Sequence[int] | None = None,
        robots: Robots | None = None,
    ) -> None:
        """Reads the settings.

        Args:
            executor: Executor of the study.
            plan: What the study does.
            numbers: Numbers of the repeats; None for all.
            robots: Robots of the repeats; None for the model's throughout.

        Raises:
            InputError: If the plan or a file does not fit.
        """
        plan.check()
        self.executor, self.plan = executor, plan
        self.numbers = range(plan.repeats) if numbers is None else numbers
        self.robots = Robots() if robots is None else robots
        self.settings: SelfCalibrationConfig = load_self_calibration(
            plan.settings
        )
        self.scenario = load_scenario(plan.scenario)
        self.repeats: list[Repeat] = []

    # Setting up

    def set_up(self) -> None:
        """Teaches the skills in direct view and sets up the mirrors."""
        plan = self.plan
        own_bodies = bool(self.robots.bodies)
        # Robots of one body share skills and views.
        taught: dict[int, tuple[Any, np.ndarray]] = {}
        setups: dict[int, MirrorSetup] = {}
        for number in self.numbers:
            skill = number if own_bodies else number % plan.skills
            body = number if own_bodies else 0
            if skill not in taught:
                taught[skill] = self._teach(skill)
            if body not in setups:
                # Only the last is needed again.
                setups = {body: self._setup(number)}
            self.repeats.append(
                self._repeat(number, setups[body], *taught[skill])
            )

    def _setup(self, number: int) -> MirrorSetup:
        plan, robots = self.plan, self.robots
        return MirrorSetup.of(
            robots.scenario(number, plan.scenario),
            robots.scenario(number, plan.direct),
        )

    def _teach(self, number: int) -> tuple[Any, np.ndarray]:
        """A skill that is learned in direct view, and its prototypes."""
        plan = self.plan
        direct = self.robots.scenario(number, plan.direct)
        demonstrations = teach_positions(
            self.executor,
            f"Kinesthetic teaching, skill {number + 1}",
            direct,
            plan.demonstrations,
            (plan.seed, SOURCE, number),
        )
        skill = learn_skill(
            load_scenario(direct).skill,
            demonstrations,
            trial_seed(plan.seed, HIDDEN, number),
        )
        return skill, stack_prototypes(demonstrations)

    def _repeat(
        self,
        number: int,
        setup: MirrorSetup,
        skill: Any,
        prototypes: np.ndarray,
    ) -> Repeat:
        """One mirror, and the robot before it."""
        plan, truth = self.plan, setup.true_knowledge()
        mirror = setup.draw_mirror(plan, self.rng(_MIRROR, number))
        errors = self.settings.knowledge.draw(
            len(truth.joints), self.rng(_ERRORS, number)
        )
        return Repeat(
            number=number,
            scenario=self.robots.scenario(number, plan.scenario),
            mirror=mirror,
            turned=setup.turned(plan, mirror, self.rng(_TURN, number)),
            known=truth.corrected(errors),
            skill=skill,
            prototypes=prototypes,
            positions=self.positions(plan.evaluations, _TESTS, number),
        )

    def repeat(self, number: int) -> Repeat:
        """The repeat of this number."""
        return self.repeats[self.numbers.index(number)]

    def rng(self, *numbers: int) -> np.random.Generator:
        """A source of randomness that belongs to these numbers alone."""
        return np.random.default_rng([self.plan.seed, *numbers])

    def positions(self, count: int, *numbers: int) -> np.ndarray:
        """Positions of the drum (count, 2) over its region, m."""
        return draw_positions(self.scenario, count, self.rng(*numbers))

    def seed(self, *numbers: int) -> int:
        """The seed of a trial."""
        return trial_seed(self.plan.seed, _TRIALS, *numbers)

    def title(self, what: str) -> str:
        """Name of a phase of the study."""
        among = ""
        if len(self.numbers) < self.plan.repeats:
            among = f", repeats {self.numbers[0] + 1}-{self.numbers[-1] + 1}"
        return f"{what}, {self.plan.scenario}{among}"

    # Trials

    def look_at(
        self, label: str, drums: Mapping[Any, Drum]
    ) -> dict[Any, GazeResult]:
        """Has the gaze search for drums."""
        return run_trials(
            self.executor,
            self.title(label),
            {
                key: at_mirror(
                    look(drum.repeat.scenario, drum.xy, drum.seed), drum.mirror
                )
                for key, drum in drums.items()
            },
        )

    def look_at_hands(
        self,
        label: str,
        looks: Mapping[int, tuple[FramePose, int, Array]],
    ) -> dict[int, HandLook]:
        """Has robots look at their hands in mirrors.

        Args:
            label: Name of this phase.
            looks: Mirror, seed and posture (n,), by repeat.
        """
        blob, aside = self.settings.hand.blob, self.settings.hand.aside
        found: dict[int, HandLookResult] = run_trials(
            self.executor,
            self.title(label),
            {
                i: at_mirror(
                    hand_look(
                        self.repeat(i).scenario, aside, seed, posture, blob
                    ),
                    mirror,
                )
                for i, (mirror, seed, posture) in looks.items()
            },
        )
        return {
            i: HandLook(
                np.array(seen.readings),
                None if seen.pixel is None else np.array(seen.pixel),
            )
            for i, seen in found.items()
        }

    def strike_spec(
        self, drum: Drum, gaze: GazeResult, mover: Any
    ) -> Spec | None:
        """The spec of a strike; None where the drum was not found."""
        spec = strike_if_seen(
            drum.repeat.scenario,
            drum.xy,
            drum.seed,
            gaze,
            mover,
            drum.repeat.prototypes,
        )
        return None if spec is None else at_mirror(spec, drum.mirror)

    def strike(
        self, label: str, tests: Mapping[Any, Spec | None]
    ) -> dict[Any, StrikeResult | None]:
        """Runs strikes; None stays None."""
        return run_strikes(self.executor, self.title(label), tests)

    # The ways to find the mirror

    def by_hand(
        self, mirrors: Mapping[int, FramePose], use: int = 0
    ) -> dict[int, Calibrated]:
        """Looks at the hand in the mirror of each of these repeats.

        Args:
            mirrors: Mirror of each repeat that takes part.
            use: Distinguishes one calibration of a repeat from another.
        """
        settings = self.settings
        sessions: dict[int, HandCalibration] = {}
        failed: dict[int, str] = {}
        steps: dict[int, list[tuple[int, Array]]] = {i: [] for i in mirrors}
        for i in mirrors:
            try:
                sessions[i] = HandCalibration(
                    self.repeat(i).known,
                    settings.knowledge,
                    settings.prior,
                    settings.hand,
                    self.rng(_HAND, i, use),
                )
            except CalibrationFailure as failure:
                failed[i] = str(failure)
        for number in range(settings.hand.looks):
            going = [i for i, session in sessions.items() if not session.done]
            if not going:
                break
            looks = self.look_at_hands(
                f"Looking at the hand{', again' * use}, {number + 1}",
                {
                    i: (
                        mirrors[i],
                        self.seed(_HAND, i, use, number),
                        sessions[i].next_posture(),
                    )
                    for i in going
                },
            )
            for i, seen in looks.items():
                sessions[i].add(seen)
                if i == 0:
                    steps[i] += _step(sessions[i])
        return {
            i: self._from_hand(self.repeat(i), sessions.get(i), failed, steps)
            for i in mirrors
        }

    def _from_hand(
        self,
        repeat: Repeat,
        session: HandCalibration | None,
        failed: Mapping[int, str],
        steps: Mapping[int, list[tuple[int, Array]]],
    ) -> Calibrated:
        if session is None:
            return Calibrated(
                None, repeat.known, None, failure=failed[repeat.number]
            )
        looks = len(session.looks)
        try:
            estimate = session.estimate()
        except CalibrationFailure as failure:
            return Calibrated(
                None, repeat.known, None, looks, failure=str(failure)
            )
        return Calibrated(
            estimate.plane,
            estimate.knowledge,
            optical_transform(estimate.knowledge, estimate.plane),
            looks,
            steps=steps[repeat.number],
            seen=session.agreeing(),
        )

    def by_ellipse(self) -> dict[int, Calibrated]:
        """Looks at the drum's marker at several places in each mirror."""
        settings = self.settings
        places = {
            each.number: self.positions(
                settings.ellipse.places, _PLACES, each.number
            )
            for each in self.repeats
        }
        looks: dict[tuple[int, int], EllipseLookResult] = run_trials(
            self.executor,
            self.title("Looking at the drum's ellipse"),
            {
                (each.number, k): at_mirror(
                    ellipse_look(
                        each.scenario,
                        xy,
                        self.seed(_PLACES, each.number, k),
                    ),
                    each.mirror,
                )
                for each in self.repeats
                for k, xy in enumerate(places[each.number])
            },
        )
        found = {}
        for each in self.repeats:
            seen = [
                EllipseLook(
                    each.known.calibration.pixels(np.array(result.tau)),
                    np.array(result.moments),
                )
                for (i, _), result in looks.items()
                if i == each.number and result.moments is not None
            ]
            found[each.number] = self._from_ellipses(each, seen)
        return found

    def _from_ellipses(
        self, repeat: Repeat, seen: Sequence[EllipseLook]
    ) -> Calibrated:
        settings = self.settings
        looks = settings.ellipse.places
        try:
            estimate = estimate_from_ellipses(
                repeat.known,
                settings.knowledge,
                seen,
                settings.prior,
                settings.ellipse,
            )
        except CalibrationFailure as failure:
            return Calibrated(
                None, repeat.known, None, looks, failure=str(failure)
            )
        drawn = estimate.plane.draw(PICTURED, self.rng(_PLACES, repeat.number))
        return Calibrated(
            estimate.plane,
            estimate.knowledge,
            optical_transform(estimate.knowledge, estimate.plane),
            looks,
            steps=[(looks, drawn)],
        )

    def first_beliefs(
        self, start: str, ellipse: Mapping[int, Calibrated]
    ) -> dict[int, PlaneBelief]:
        """With what the robot begins to listen.

        Args:
            start: "prior": somewhere on the left; "ellipse": after looks at
                the drum's marker.
            ellipse: What these came to.
        """
        settings = self.settings
        corners = self.scenario.drum_region.corners
        beliefs = {}
        for each in self.repeats:
            rng = self.rng(_EAR, each.number, int(start == "ellipse"))
            known = ellipse[each.number]
            if start == "ellipse" and known.plane is not None:
                beliefs[each.number] = PlaneBelief.from_estimate(
                    known.known, known.plane, corners, settings.ear, rng
                )
            else:
                beliefs[each.number] = PlaneBelief.from_prior(
                    each.known, settings.prior, corners, settings.ear, rng
                )
        return beliefs


def optical_transform(
    known: RobotKnowledge, plane: PlaneEstimate
) -> Callable[[Array], Array]:
    """From the mirror's task parameters to the direct ones, by a plane."""
    optical = known.optical_map()
    parameters = plane.from_point(known.eye_position).parameters
    return lambda tau: optical.apply(parameters, tau)


def belief_transform(belief: PlaneBelief) -> Callable[[Array], Array]:
    """The same by a belief: where a stroke most likely hits."""

    def transform(tau: Array) -> Array:
        return np.array([belief.choose(each, 0.0).tau for each in tau])

    return transform


def _step(session: HandCalibration) -> list[tuple[int, Array]]:
    """Planes believed after the looks until now, for the picture."""
    try:
        plane = session.estimate().plane
    except CalibrationFailure:
        return []
    drawn = plane.draw(PICTURED, np.random.default_rng(0))
    return [(len(session.looks), drawn)]
