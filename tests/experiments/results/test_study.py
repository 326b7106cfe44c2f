"""Results of studies, written and read back."""

import copy
import json

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments.results import STUDY_RESULTS, read_study
from support import report_data

STUDIES = list(STUDY_RESULTS)


def made_up(study):
    """A study's results.json as JSON gives it."""
    return json.loads(json.dumps(getattr(report_data, study)()))


def test_every_study_is_known_by_its_name():
    assert {each.KIND for each in STUDY_RESULTS.values()} == set(STUDIES)


@pytest.mark.parametrize("study", STUDIES)
def test_results_begin_with_the_study_and_are_read_as_written(study):
    plain = made_up(study)
    results = read_study(study, plain, "results.json: ")
    written = json.loads(json.dumps(to_plain(results)))
    assert list(written)[:3] == ["study", "version", "seed"]
    assert written["study"] == study
    assert read_study(study, written, "results.json: ") == results


@pytest.mark.parametrize(
    ("study", "place", "value", "message"),
    [
        ("drum", ("similarity", "t"), [], "similarity has lists of several"),
        ("drum", ("final", "success_rate"), 1.5, "final.success_rate is 1.5"),
        ("mirror", ("samples",), [3, 99], "has nothing for 99 samples"),
        ("mirror", ("map", "shape"), [2, 2], "expected a grid of"),
        ("mirror", ("map", "input_names"), ["x"], "has not two names"),
        ("scenarios", ("scenarios",), {}, "scenarios is empty"),
        ("conditions", ("conditions",), [], "conditions is empty"),
        ("toy", ("source", "train_mse"), "low", "source.train_mse is 'low'"),
        ("demo", ("mirror", "samples"), None, "mirror.samples is None"),
    ],
)
def test_what_does_not_fit_is_named(study, place, value, message):
    plain = copy.deepcopy(made_up(study))
    inside = plain
    for name in place[:-1]:
        inside = inside[name]
    inside[place[-1]] = value
    with pytest.raises(InputError, match=message):
        read_study(study, plain, "results.json: ")
