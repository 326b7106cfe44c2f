"""Folders that are no studies, and damaged ones."""

import pytest

from drake_affetto import report
from drake_affetto.common.errors import InputError
from support import report_data


def change(results, place, value):
    """Sets what stands at a path like `final.positions.0.reward`."""
    *way, last = place.split(".")
    for step in way:
        results = results[int(step) if step.isdigit() else step]
    if value is ...:
        del results[last]
    else:
        results[int(last) if last.isdigit() else last] = value


@pytest.mark.parametrize(
    ("study", "place", "value", "named"),
    [
        ("drum", "by_demonstrations", ..., "by_demonstrations is missing"),
        ("drum", "by_demonstrations", [], "by_demonstrations is empty"),
        (
            "drum",
            "by_demonstrations.3.success_rate.mean",
            1.5,
            "by_demonstrations[3].success_rate.mean is 1.5",
        ),
        ("drum", "final.positions.0.xy", [1.0], "positions[0].xy is [1.0]"),
        ("drum", "final.positions.0.success", 1, "positions[0].success is 1"),
        ("drum", "final.positions", [], "final.positions is empty"),
        ("drum", "final.positions.0.reward", 1e308, "reward is 1e+308"),
        ("drum", "final.positions.0.tau", [0.1], "tau is [0.1], expected 2"),
        ("drum", "separation.hits", -1, "separation.hits is -1"),
        ("drum", "taught.0.attempts", -3, "taught[0].attempts is -3"),
        ("drum", "repeats", -1, "repeats is -1"),
        ("drum", "separation.threshold", 1e308, "threshold is 1e+308"),
        ("mirror", "evaluations", -2, "evaluations is -2"),
        ("demo", "mirror.schemes.relearn.rewards", [2.0], "[0] is 2.0"),
        ("toy", "source.test_mse", -1e-3, "test_mse is -0.001"),
        ("toy", "source.per_seed", {"a": [1e200]}, "per_seed.a[0] is 1e+200"),
        ("demo", "mirror.positions", [], "positions is empty"),
        ("drum", "similarity.hit", [0.1], "similarity has lists"),
        ("drum", "separation.auc", "high", "separation.auc is 'high'"),
        ("drum", "seed", True, "seed is True"),
        ("drum", "version", "9.1.0", "was made by version 9.1.0"),
        ("drum", "version", "0.0.1", "was made by version 0.0.1"),
        ("drum", "study", "identify", "'identify'"),
        ("drum", "study", ["drum"], "['drum']"),
        ("drum", "study", ..., "does not say of which study"),
        ("mirror", "schemes", {}, "schemes is empty"),
        ("mirror", "schemes.relearn.4", ..., "relearn has nothing for 4"),
        ("mirror", "comparisons.0.p_corrected", ..., "p_corrected is missing"),
        ("mirror", "map.shape", [11, 12], "map has 121 inputs"),
        ("mirror", "map.taught_output", [], "taught inputs and outputs"),
        ("mirror", "samples", [], "samples is empty"),
        ("scenarios", "scenarios", {}, "scenarios is empty"),
        (
            "scenarios",
            "scenarios.mirror.schemes.relearn",
            3,
            "scenarios.mirror.schemes.relearn is 3",
        ),
        ("conditions", "conditions.0.samples", 2.5, "samples is 2.5"),
        ("conditions", "conditions", [], "conditions is empty"),
        ("toy", "transfer.default", ..., None),
        ("toy", "transfer", {}, "transfer is empty"),
        ("toy", "wide.source", ..., "wide.source is missing"),
        ("demo", "mirror.schemes.relearn.rewards", None, "rewards is None"),
    ],
)
def test_results_of_another_shape_are_named(
    tmp_path, study, place, value, named
):
    results = getattr(report_data, study)()
    change(results, place, value)
    folder = report_data.write(tmp_path / "study", results)
    if named is None:
        report.write_report([folder], tmp_path / "page.html")
        return
    with pytest.raises(InputError) as error:
        report.write_report([folder], tmp_path / "page.html")
    assert named in str(error.value)
    assert str(folder / "results.json") in str(error.value)
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize(
    "text", ["", "[]", '{"study": "drum"', '{"seed": NaN}', "\xff", "[" * 10**5]
)
def test_files_that_are_no_results(tmp_path, text):
    (tmp_path / "results.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"results\.json"):
        report.write_report([tmp_path], tmp_path / "page.html")


def test_a_long_list_is_not_printed_whole(tmp_path):
    (tmp_path / "results.json").write_text(str(list(range(100_000))))
    with pytest.raises(InputError, match="expected an object") as error:
        report.write_report([tmp_path], tmp_path / "page.html")
    assert len(str(error.value)) < 300


def test_folders_that_do_not_fit(tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"empty has no results\.json"):
        report.write_report([empty], tmp_path / "page.html")
    with pytest.raises(InputError, match="nowhere"):
        report.write_report([tmp_path / "nowhere"], tmp_path / "page.html")
    with pytest.raises(InputError, match="at least one"):
        report.write_report([], tmp_path / "page.html")
    twice = [
        report_data.write(tmp_path / name, report_data.toy())
        for name in ("one", "two")
    ]
    with pytest.raises(InputError, match=r"one.*two.*both of the study toy"):
        report.write_report(twice, tmp_path / "page.html")
    with pytest.raises(InputError, match="a file, not a folder"):
        report.write_report(twice[:1], tmp_path)
