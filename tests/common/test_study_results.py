"""Results begin with the study, and repeat its plan."""

import dataclasses
from typing import ClassVar

from drake_affetto import __version__
from drake_affetto.common.study_results import StudyResults
from drake_affetto.common.typed_json import from_plain, to_plain


@dataclasses.dataclass(frozen=True)
class Plan:
    repeats: int = 3
    samples: tuple[int, ...] = (4, 5)
    active: bool = True
    unused: str = "not a result"
    seed: int = 7


@dataclasses.dataclass(frozen=True)
class Results(StudyResults):
    KIND: ClassVar[str] = "probe"

    samples: list[int]
    repeats: int
    active: list[float] | None
    rate: float


def test_results_begin_with_the_study_and_repeat_its_plan():
    results = Results.of(Plan(), active=None, rate=0.5)
    assert list(to_plain(results).items()) == [
        ("study", "probe"),
        ("version", __version__),
        ("seed", 7),
        ("samples", [4, 5]),
        ("repeats", 3),
        ("active", None),
        ("rate", 0.5),
    ]


def test_they_are_read_back_as_they_were_written():
    results = Results.of(Plan(), active=[0.1], rate=0.5)
    assert from_plain(Results, to_plain(results)) == results
    results.check("results.json: ")
