"""Which faults a study injects, in which sizes, and when they begin."""

import dataclasses

import numpy as np

from drake_affetto.common.errors import (
    require,
    require_interval,
    require_range,
)
from drake_affetto.common.yaml_config import load_config
from drake_affetto.faults.config import KINDS, TO_THE_END, TRIAL, Fault

DEFAULT_FILE = "package://drake_affetto/faults.yaml"


@dataclasses.dataclass
class FaultSweep:
    """A kind of fault in some sizes.

    Attributes:
        kind: One of `faults.config.KINDS`.
        sizes: Its sizes, in the kind's unit; [1] where it has none.
        span: First and last time at which it may begin, s.
        length: How long it lasts, s.
        since: What the times are counted from, "trial" or "movement".
    """

    kind: str = ""
    sizes: list[float] = dataclasses.field(default_factory=lambda: [1.0])
    span: list[float] = dataclasses.field(default_factory=lambda: [0.3, 6.0])
    length: float = TO_THE_END
    since: str = TRIAL

    def draw(
        self, size: float, joints: list[str], rng: np.random.Generator
    ) -> Fault:
        """A fault of that size: onset, joint and chamber are drawn."""
        onset = float(rng.uniform(self.span[0], self.span[1]))
        joint = joints[int(rng.integers(len(joints)))]
        channel = str(rng.choice(["a", "b"]))
        place = KINDS[self.kind].place
        return Fault(
            kind=self.kind,
            onset=onset,
            length=self.length,
            size=size,
            joint=joint if place in ("joint", "chamber") else "",
            channel=channel if place == "chamber" else "",
            since=self.since,
        )


@dataclasses.dataclass
class FaultCatalog:
    """All that a study injects.

    Attributes:
        joints: Joints among which those of faults are drawn.
        faults: The kinds of fault.
    """

    joints: list[str] = dataclasses.field(default_factory=list)
    faults: list[FaultSweep] = dataclasses.field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require(len(self.joints) > 0, f"{where}.joints", self.joints, "joints")
        require(len(self.faults) > 0, f"{where}.faults", self.faults, "faults")
        rng = np.random.default_rng(0)
        for i, sweep in enumerate(self.faults):
            field = f"{where}.faults[{i}]"
            require_interval(f"{field}.span", sweep.span)
            require_range(f"{field}.span[0]", sweep.span[0], 0.0)
            require(
                len(sweep.sizes) > 0, f"{field}.sizes", sweep.sizes, "sizes"
            )
            # The kind first: without it nothing can be drawn.
            Fault(kind=sweep.kind).check_kind(field)
            for size in sweep.sizes:
                fault = sweep.draw(size, self.joints, rng)
                fault.check(field, self.joints)

    @property
    def cells(self) -> list[tuple[int, float]]:
        """Each kind's number with each of its sizes."""
        return [
            (i, size)
            for i, sweep in enumerate(self.faults)
            for size in sweep.sizes
        ]


def load_catalog(source: str = DEFAULT_FILE) -> FaultCatalog:
    """Reads a catalog of faults.

    Raises:
        InputError: For a file or a value in it that does not fit, by name.
    """
    return load_config(FaultCatalog, source)
