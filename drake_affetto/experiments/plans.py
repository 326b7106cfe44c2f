"""How much each study does.

Nothing heavy is imported here: a command's help shows a plan's defaults.
"""

import dataclasses

from drake_affetto.common.errors import require, require_choice, require_range
from drake_affetto.common.fields import check_ranges, number, option
from drake_affetto.skill.scheme_names import PAPER_SCHEMES, SCHEMES

GREATEST_SEED = 2**31 - 1


@dataclasses.dataclass(frozen=True)
class Plan:
    """The plan of a study; fields with a help are options of its command."""

    def check(self) -> None:
        """Raises InputError for the first value that does not fit."""
        check_ranges(self)


def _repeat_for_bodies(
    plan: "DrumPlan | MirrorPlan | SelfCalibrationPlan",
) -> None:
    # What is no number is told by `check`.
    if isinstance(plan.bodies, int) and plan.bodies > 0:
        object.__setattr__(plan, "repeats", plan.bodies)


@dataclasses.dataclass(frozen=True)
class DrumPlan(Plan):
    """How much the drumming study does.

    Attributes:
        demonstrations: Number of demonstrations of a repeat.
        evaluations: Number of test positions, the same throughout the study.
        repeats: Number of times that all of it is done, each with other
            demonstrations.
        bodies: Number of robots of other bodies, each with a repeat of its
            own: they take the place of `repeats`. 0: one robot throughout.
        active: Whether the skill's own order is tried too.
        after: Numbers of demonstrations after which the skill is tested; empty
            for every one. After the last it always is.
        repeat_invalid: How often a trial that the supervisor does not pass is
            repeated, with another seed.
        scenario: Scenario, by name or path.
        seed: Seed of everything that is random.
    """

    demonstrations: int = number(
        25, 3, 1000, "number of demonstrations in direct view"
    )
    evaluations: int = number(
        10, 1, 1000, "number of test positions, which were not demonstrated"
    )
    repeats: int = number(
        1, 1, 1000, "independent repeats, each with other demonstrations"
    )
    bodies: int = number(
        0, 0, 1000, "robots of other bodies, a repeat each; 0: one robot"
    )
    active: bool = option(
        False, "also let the skill choose which demonstration comes next"
    )
    after: tuple[int, ...] = number(
        (), 1, 1000, "test the skill only after so many demonstrations"
    )
    repeat_invalid: int = number(
        0,
        0,
        100,
        "repeat trials that the supervisor does not pass so often",
    )
    scenario: str = option("drumming", "scenario, by name or YAML file")
    seed: int = number(0, 0, GREATEST_SEED, "seed of everything that is random")

    def __post_init__(self) -> None:
        """Each body has a repeat of its own."""
        _repeat_for_bodies(self)

    def check(self) -> None:
        """Raises InputError for the first value that does not fit."""
        super().check()
        for count in self.after:
            require_range("--after", count, 1, self.demonstrations)

    @property
    def tested_after(self) -> list[int]:
        """Numbers of demonstrations after which the skill is tested."""
        every = range(1, self.demonstrations + 1)
        return sorted({*(self.after or every), self.demonstrations})


@dataclasses.dataclass(frozen=True)
class MirrorPlan(Plan):
    """What is compared in a changed view, and how often.

    Attributes:
        scenario: Scenario of the changed view, by name or path.
        samples: Numbers of demonstrations that the schemes are given.
        repeats: Number of times that all of it is done, each with another
            skill, other demonstrations and other test positions.
        bodies: Number of robots of other bodies, each with a repeat of its
            own: they take the place of `repeats`. 0: one robot throughout.
        evaluations: Number of test positions of a repeat.
        demonstrations: Number of demonstrations in direct view, from which
            the skill is learned.
        pool: Number of demonstrations in the changed view, from which samples
            are drawn; None for the paper's 6, or as many as the most samples.
        schemes: Schemes that are compared, see `SCHEMES`.
        choice: How samples are chosen, at "random" or "spread" out.
        variability: Factor of the teacher's variation.
        workspace: Share of the region's length and width that is used.
        direct: Scenario in which the skill is learned.
        repeat_invalid: How often a trial that the supervisor does not pass is
            repeated, with another seed.
        name: Name of this plan among others in one store, for display.
        seed: Seed of everything that is random.
    """

    scenario: str = "mirror"
    samples: tuple[int, ...] = number(
        (1, 2, 3, 4, 5),
        1,
        100,
        "numbers of demonstrations schemes are given",
    )
    repeats: int = number(
        20, 1, 1000, "independent repeats, each with another skill and teacher"
    )
    bodies: int = number(
        0, 0, 1000, "robots of other bodies, a repeat each; 0: one robot"
    )
    evaluations: int = number(8, 1, 1000, "number of test positions a repeat")
    demonstrations: int = number(
        25, 3, 1000, "number of demonstrations in direct view"
    )
    pool: int | None = None
    schemes: tuple[str, ...] = option(
        SCHEMES, "schemes that are compared", metavar="SCHEME"
    )
    choice: str = "random"
    variability: float = number(1.0, 0.0, 10.0)
    workspace: float = number(1.0, 0.05, 1.0)
    direct: str = "drumming"
    repeat_invalid: int = number(
        0,
        0,
        100,
        "repeat trials that the supervisor does not pass so often",
    )
    name: str = ""
    seed: int = number(0, 0, GREATEST_SEED, "seed of everything that is random")

    def __post_init__(self) -> None:
        """Each body has a repeat of its own."""
        _repeat_for_bodies(self)

    @property
    def pool_size(self) -> int:
        """Number of demonstrations to choose from."""
        return max(6, *self.samples) if self.pool is None else self.pool

    def check(self) -> None:
        """Raises InputError for the first value that does not fit."""
        super().check()
        require(
            len(set(self.samples)) == len(self.samples) > 0,
            "--samples",
            list(self.samples),
            "numbers of samples, each once",
        )
        require(
            len(set(self.schemes)) == len(self.schemes) > 0,
            "--schemes",
            list(self.schemes),
            "schemes, each once",
        )
        for scheme in self.schemes:
            require_choice("--schemes", scheme, *SCHEMES)
        require_range("pool", self.pool_size, max(self.samples), 1000)
        require_choice("choice", self.choice, "random", "spread")


@dataclasses.dataclass(frozen=True)
class SelfCalibrationPlan(Plan):
    """How the robot finds mirrors by itself, and how often.

    Attributes:
        scenario: Scenario of the view with the mirror, by name or path.
        samples: Numbers of demonstrations that the schemes beside are given.
        repeats: Number of times that all of it is done, each with a mirror,
            a robot that knows itself badly in its own way, and positions of
            its own.
        bodies: Number of robots of other bodies, each with a repeat and a
            skill of its own: they take the place of `repeats`. 0: one robot.
        evaluations: Number of unseen positions of a repeat.
        demonstrations: Number of demonstrations in direct view, from which
            the skill is learned.
        skills: Number of skills that are learned; repeats of one body share
            them.
        schemes: Schemes that are compared with demonstrations.
        rotation: Greatest turn of the mirror about x and z, degrees.
        translation: Greatest shift of the mirror along each axis, m.
        least_seen: Share of the drum's region that a mirror must show; one
            that does not is set up anew.
        turned_by: Angle by which the mirror is turned in between, degrees.
        turned_after: Number of strokes after which it is.
        quiet: Number of strokes before these, in which it stays too.
        settings: YAML file of the self-calibration.
        direct: Scenario in which the skill is learned.
        seed: Seed of everything that is random.
    """

    scenario: str = "mirror"
    samples: tuple[int, ...] = number((3, 4, 5), 2, 100)
    repeats: int = number(10, 1, 1000)
    bodies: int = number(0, 0, 1000)
    evaluations: int = number(8, 1, 1000)
    demonstrations: int = number(25, 3, 1000)
    skills: int = number(2, 1, 1000)
    schemes: tuple[str, ...] = ("relearn", "transfer_default")
    rotation: float = number(
        8.0, 0.0, 30.0, "greatest turn of its mirrors about x and z, degrees"
    )
    translation: float = number(
        0.05, 0.0, 0.3, "greatest shift of its mirrors along each axis, m"
    )
    least_seen: float = number(0.95, 0.0, 1.0)
    turned_by: float = number(5.0, -45.0, 45.0)
    turned_after: int = number(10, 1, 1000)
    quiet: int = number(20, 0, 1000)
    settings: str = "package://drake_affetto/self_calibration.yaml"
    direct: str = "drumming"
    seed: int = number(0, 0, GREATEST_SEED)

    def __post_init__(self) -> None:
        """Each body has a repeat of its own."""
        _repeat_for_bodies(self)

    @property
    def pool_size(self) -> int:
        """Number of demonstrations before each mirror."""
        return max(self.samples)


@dataclasses.dataclass(frozen=True)
class DemoPlan(Plan):
    """How much the demo does.

    Attributes:
        demonstrations: Number of demonstrations in direct view.
        evaluations: Number of test positions in direct view.
        samples: Number of demonstrations before the mirror.
        mirror_evaluations: Number of test positions before the mirror.
        seed: Seed of everything that is random.
    """

    demonstrations: int = 12
    evaluations: int = 8
    samples: int = 5
    mirror_evaluations: int = 5
    seed: int = number(0, 0, GREATEST_SEED, "seed of everything that is random")

    @property
    def drum(self) -> DrumPlan:
        """The study in direct view."""
        return DrumPlan(
            demonstrations=self.demonstrations,
            evaluations=self.evaluations,
            # Only the skill that knows them all is tested.
            after=(self.demonstrations,),
            seed=self.seed,
        )

    @property
    def mirror(self) -> MirrorPlan:
        """The study before the mirror, which learns the same skill."""
        return MirrorPlan(
            samples=(self.samples,),
            repeats=1,
            evaluations=self.mirror_evaluations,
            demonstrations=self.demonstrations,
            pool=self.samples,
            schemes=(*PAPER_SCHEMES, "transfer_default"),
            seed=self.seed,
        )


@dataclasses.dataclass(frozen=True)
class FaultsPlan(Plan):
    """How many trials are run with faults.

    Attributes:
        repeats: Number of trials of each fault and size, and as many without.
        demonstrations: Number of demonstrations that the skill is learned from.
        scenario: Scenario with a supervisor, by name or path.
        catalog: YAML file of the faults.
        seed: Seed of everything that is random.
    """

    repeats: int = number(
        10, 1, 1000, "trials of each fault and size, and as many without"
    )
    demonstrations: int = number(
        25, 3, 1000, "number of demonstrations that the skill is learned from"
    )
    scenario: str = option(
        "supervised", "scenario with a supervisor, by name or YAML file"
    )
    catalog: str = option(
        "package://drake_affetto/faults.yaml",
        "YAML file of the faults and their sizes",
        metavar="FILE",
    )
    seed: int = number(0, 0, GREATEST_SEED, "seed of everything that is random")


@dataclasses.dataclass(frozen=True)
class TeachPlan(Plan):
    """How many demonstrations are taught into a file.

    Attributes:
        demonstrations: Number of positions of the drum.
        scenario: Scenario, by name or path.
        seed: Seed of the positions and the teacher.
    """

    demonstrations: int = number(
        25,
        1,
        # Each position has a seed of its own, counted from seed * SEEDS on.
        100_000,
        "number of positions of the drum, a demonstration at each",
    )
    scenario: str = option("drumming", "scenario, by name or YAML file")
    seed: int = number(0, 0, GREATEST_SEED, "seed of everything that is random")


@dataclasses.dataclass(frozen=True)
class ToyPlan(Plan):
    """How much the toy experiment does.

    Attributes:
        repeats: Number of choices of five points for each seed, as in the
            paper.
        seeds: Number of draws of data and hidden layer.
        seed: The first of the seeds.
    """

    repeats: int = number(
        100, 1, 100_000, "choices of five points for each seed, as in the paper"
    )
    seeds: int = number(
        20, 1, 100_000, "draws of data and hidden layer, one seed each"
    )
    seed: int = number(0, 0, GREATEST_SEED, "the first of the seeds")
