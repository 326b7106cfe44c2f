"""Any study's results, read from its results.json."""

from typing import Any

from drake_affetto.common.study_results import StudyResults
from drake_affetto.common.typed_json import from_plain
from drake_affetto.experiments.results.demo import DemoResults
from drake_affetto.experiments.results.drumming import DrumResults
from drake_affetto.experiments.results.faults import FaultsResults
from drake_affetto.experiments.results.mirror import (
    ConditionsResults,
    MirrorResults,
    ScenariosResults,
)
from drake_affetto.experiments.results.toy import ToyResults

STUDY_RESULTS: dict[str, type[StudyResults]] = {
    each.KIND: each
    for each in (
        DemoResults,
        DrumResults,
        MirrorResults,
        ScenariosResults,
        ConditionsResults,
        ToyResults,
        FaultsResults,
    )
}


def read_study(study: str, plain: Any, where: str) -> Any:
    """Reads a study's results from JSON's plain data.

    Args:
        study: Kind of study, a key of `STUDY_RESULTS`.
        plain: Content of its results.json.
        where: Name of the file in error messages, ending in ": ".

    Raises:
        InputError: If it is of another shape; the line names the place.
    """
    results = from_plain(STUDY_RESULTS[study], plain, where)
    results.check(where)
    return results
