"""Settings of the self-calibration, as `models/self_calibration.yaml` has."""

import dataclasses

from drake_affetto.calibration.knowledge import KnowledgeErrors
from drake_affetto.calibration.plane import PlanePrior
from drake_affetto.common.errors import require, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.perception.blob import BlobConfig
from drake_affetto.perception.config import require_vector


@dataclasses.dataclass
class HandConfig:
    """How the robot looks at its own hand in the mirror.

    Attributes:
        blob: How the hand's marker looks.
        space_low: Least x, y, z of the marker's place in the world, m.
        space_high: Greatest, m.
        aside: Where the drum stands meanwhile, x, y, m.
        joint_margin: Distance from the joints' limits, rad.
        candidates: Number of postures among which the next is chosen.
        looks: Greatest number of looks.
        fewest: Least number of looks that show the marker.
        spread: Least deviation of the hand's places across their line, m.
        pixel_sd: Noise of the marker's image, px.
        visible_width: How far an image tells whether its neighbors are within
            the glass, px.
        clear: Distance in the image that the marker keeps from the direct
            view's edge, px.
        angle_goal: Looking ends once the normal is known so exactly, rad,
        distance_goal: and the distance, m.
        angle_limit: Beyond this uncertainty nothing has been found, rad,
        distance_limit: nor beyond this, m.
    """

    blob: BlobConfig = dataclasses.field(default_factory=BlobConfig)
    space_low: list[float] = dataclasses.field(
        default_factory=lambda: [0.12, -0.30, 0.12]
    )
    space_high: list[float] = dataclasses.field(
        default_factory=lambda: [0.36, 0.12, 0.30]
    )
    aside: list[float] = dataclasses.field(
        default_factory=lambda: [0.55, -0.29]
    )
    joint_margin: float = number(0.05, 0.0, 1.0)
    candidates: int = number(150, 10, 10_000)
    looks: int = number(12, 1, 1000)
    fewest: int = number(4, 3, 1000)
    spread: float = number(0.015, 0.0, 1.0)
    pixel_sd: float = number(0.7, 1e-3, 100.0)
    visible_width: float = number(35.0, 1.0, 1000.0)
    clear: float = number(25.0, 0.0, 1000.0)
    angle_goal: float = number(0.006, 0.0, 1.0)
    distance_goal: float = number(0.002, 0.0, 1.0)
    angle_limit: float = number(0.06, 0.0, 1.0)
    distance_limit: float = number(0.03, 0.0, 1.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        self.blob.check(f"{where}.blob")
        for name in ("space_low", "space_high"):
            require_vector(f"{where}.{name}", getattr(self, name), 3, -2, 2)
        require_vector(f"{where}.aside", self.aside, 2, -2, 2)
        for i, (low, high) in enumerate(
            zip(self.space_low, self.space_high, strict=True)
        ):
            require(
                low < high,
                f"{where}.space_high[{i}]",
                high,
                f"more than {where}.space_low[{i}] ({low:g})",
            )


@dataclasses.dataclass
class EllipseConfig:
    """How the drum's marker is measured in the mirror.

    Attributes:
        moment_sd: Noise of the shape's features, lengths like the square root
            of its second moments, px.
        bias: Error of the features that all images share, u, slope and v, px.
        bias_sd: How exactly that is known, px.
        blur: Standard deviation of the image's own blur, px.
        places: Number of the drum's places that are looked at.
        fewest: Least number of them.
    """

    moment_sd: float = number(0.04, 1e-4, 100.0)
    bias: list[float] = dataclasses.field(default_factory=lambda: [0.0] * 3)
    bias_sd: float = number(0.02, 1e-4, 100.0)
    blur: float = number(0.289, 0.0, 10.0)
    places: int = number(8, 1, 1000)
    fewest: int = number(3, 1, 1000)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        require_vector(f"{where}.bias", self.bias, 3, -10, 10)


@dataclasses.dataclass
class EarConfig:
    """How strokes and their sound tell of the plane.

    Attributes:
        particles: Number of planes of which the belief is made.
        reach: Distance of the stroke from the drum's center at which it is
            heard as often as not, m.
        softness: Width of that border, m.
        surest: Greatest chance that a stroke is heard.
        luck: Chance that a stroke which should miss is heard.
        explore: Weight of what a stroke teaches against that it hits.
        jitter: How far particles are moved as they are drawn anew, as a share
            of their deviation.
        beyond: Distance from the workspace at which a drum may still be, m.
        stray: Share of drums that are taken to be farther away.
    """

    particles: int = number(3000, 10, 1_000_000)
    reach: float = number(0.05, 0.001, 1.0)
    softness: float = number(0.008, 1e-4, 1.0)
    surest: float = number(0.92, 0.5, 1.0)
    luck: float = number(0.02, 0.0, 0.5)
    explore: float = number(0.3, 0.0, 100.0)
    jitter: float = number(0.15, 0.0, 0.9)
    beyond: float = number(0.02, 0.0, 1.0)
    stray: float = number(0.02, 1e-6, 1.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)


@dataclasses.dataclass
class WatchConfig:
    """How the robot notices that what it believes of the mirror is wrong.

    Attributes:
        hit_when_right: Share of strokes that are heard while it is right; the
            stroke's own chance is taken where it is less.
        hit_when_wrong: Share of strokes that are heard while it is wrong.
        strange_when_right: Share of drums that are seen where none can stand,
            while it is right.
        strange_when_wrong: The same while it is wrong.
        threshold: Sum of log likelihood ratios at which it is noticed by
            strokes alone.
        suspicion: Sum at which the robot looks at its hand again, to see.
        recheck_looks: Number of such looks of which the majority decides.
        recheck_limit: Distance from where the hand should show, beyond which
            a look speaks against the belief, px.
    """

    hit_when_right: float = number(0.95, 0.5, 0.9999)
    hit_when_wrong: float = number(0.3, 0.0001, 0.9)
    strange_when_right: float = number(0.02, 1e-6, 0.5)
    strange_when_wrong: float = number(0.3, 1e-6, 0.99)
    threshold: float = number(5.0, 0.1, 100.0)
    suspicion: float = number(1.5, 0.1, 100.0)
    recheck_looks: int = number(3, 1, 99)
    recheck_limit: float = number(8.0, 0.1, 1000.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        require_range(
            f"{where}.hit_when_wrong",
            self.hit_when_wrong,
            0.0,
            self.hit_when_right,
        )
        require_range(
            f"{where}.strange_when_right",
            self.strange_when_right,
            0.0,
            self.strange_when_wrong,
        )
        require(
            self.recheck_looks % 2 == 1,
            f"{where}.recheck_looks",
            self.recheck_looks,
            "an odd number: the majority decides",
        )


@dataclasses.dataclass
class SelfCalibrationConfig:
    """All settings of the self-calibration.

    Attributes:
        prior: What is taken for granted of the mirror.
        knowledge: How exactly the robot takes its model of itself to be; it
            is drawn so wrong in each repeat.
        hand: See `HandConfig`.
        ellipse: See `EllipseConfig`.
        ear: See `EarConfig`.
        watch: See `WatchConfig`.
    """

    prior: PlanePrior = dataclasses.field(default_factory=PlanePrior)
    knowledge: KnowledgeErrors = dataclasses.field(
        default_factory=KnowledgeErrors
    )
    hand: HandConfig = dataclasses.field(default_factory=HandConfig)
    ellipse: EllipseConfig = dataclasses.field(default_factory=EllipseConfig)
    ear: EarConfig = dataclasses.field(default_factory=EarConfig)
    watch: WatchConfig = dataclasses.field(default_factory=WatchConfig)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        for field in dataclasses.fields(self):
            getattr(self, field.name).check(f"{where}.{field.name}")


def load_self_calibration(
    uri: str = "package://drake_affetto/self_calibration.yaml",
) -> SelfCalibrationConfig:
    """Reads and checks a file of these settings.

    Args:
        uri: The file, or its package:// URI.

    Raises:
        InputError: for a missing or malformed file, an unknown field or a
            value out of range.
    """
    # Drake's YAML reader, which the mathematics beside this do not need.
    from drake_affetto.common.yaml_config import load_config

    return load_config(SelfCalibrationConfig, uri)
