"""What the results of every study begin with."""

import dataclasses
from typing import Any, ClassVar, Self

from drake_affetto import __version__

# What a field that counts accepts, see `typed_json`.
COUNT = {"range": (0, 10**9)}


@dataclasses.dataclass(frozen=True)
class StudyResults:
    """The content of a results.json: what was planned, then what was found.

    Attributes:
        study: Kind of study, the `KIND` of its class.
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
    """

    KIND: ClassVar[str]

    study: str
    version: str
    seed: int

    @classmethod
    def of(cls, plan: Any, **found: Any) -> Self:
        """Results that repeat the plan where they have a field of that name.

        Args:
            plan: Dataclass of the study's plan, with at least the seed.
            found: The other fields; they also replace values of the plan.
        """
        names = {field.name for field in dataclasses.fields(cls)}
        planned = {
            field.name: getattr(plan, field.name)
            for field in dataclasses.fields(plan)
            if field.name in names
        }
        for name, value in planned.items():
            if isinstance(value, tuple):
                planned[name] = list(value)
        begin = {"study": cls.KIND, "version": __version__}
        return cls(**(begin | planned | found))

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other.

        Args:
            where: Name of the file in error messages, ending in ": ".
        """
