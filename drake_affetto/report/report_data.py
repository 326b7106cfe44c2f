"""The results of all studies on a page, brought into one form."""

from collections.abc import Mapping, Sequence
import dataclasses
from typing import Any

from drake_affetto.experiments.results import (
    DemoTaught,
    DemoTrial,
    EvaluatedPosition,
    TaughtPosition,
)
from drake_affetto.report.comparison import SchemeComparison
from drake_affetto.report.study_folder import StudyFolder


@dataclasses.dataclass(frozen=True)
class Drumming:
    """The drum seen directly, from its study or from the demo.

    Attributes:
        demonstrations: Number of demonstrations of a repeat.
        taught: Demonstrations.
        tests: Trials at test positions.
        per_repeat: Number of test positions.
        repeats: Number of repeats.
    """

    demonstrations: int
    taught: Sequence[TaughtPosition | DemoTaught]
    tests: Sequence[EvaluatedPosition | DemoTrial]
    per_repeat: int
    repeats: int

    @property
    def hits(self) -> int:
        """Number of tests that were heard as a drum."""
        return sum(row.success for row in self.tests)


@dataclasses.dataclass(frozen=True)
class ReportData:
    """What the page is made from.

    Attributes:
        folders: Folders by study.
        comparison: Schemes in the mirror, from the study or the demo.
        comparisons: Schemes by changed view.
        drumming: The drum seen directly, from the study or the demo.
    """

    folders: Mapping[str, StudyFolder]
    comparison: SchemeComparison | None
    comparisons: Mapping[str, SchemeComparison]
    drumming: Drumming | None

    def results(self, study: str) -> Any:
        """The results of a study; None if it is not there."""
        folder = self.folders.get(study)
        return folder.results if folder else None


def collect(folders: Mapping[str, StudyFolder]) -> ReportData:
    """Brings the results of different studies into one form."""
    comparisons = {}
    if "scenarios" in folders:
        comparisons = {
            name: SchemeComparison.of_study(results, name)
            for name, results in folders["scenarios"].results.scenarios.items()
        }
    comparison = None
    if "mirror" in folders:
        results = folders["mirror"].results
        comparison = SchemeComparison.of_study(results, results.scenario)
    elif "mirror" in comparisons:
        comparison = comparisons["mirror"]
    elif "demo" in folders and folders["demo"].results.mirror.schemes:
        comparison = SchemeComparison.of_demo(folders["demo"].results.mirror)
    return ReportData(folders, comparison, comparisons, _drumming(folders))


def _drumming(folders: Mapping[str, StudyFolder]) -> Drumming | None:
    if "drum" in folders:
        drum = folders["drum"].results
        return Drumming(
            drum.demonstrations,
            drum.taught,
            drum.final.positions,
            drum.evaluations,
            drum.repeats,
        )
    if "demo" in folders:
        demo = folders["demo"].results.drumming
        tests = demo.positions
        return Drumming(demo.demonstrations, demo.taught, tests, len(tests), 1)
    return None
