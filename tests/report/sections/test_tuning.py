"""The section on tuned gains."""

import json

import pytest

from drake_affetto import report
from drake_affetto.common.errors import InputError
from support import report_data
from support.report_page import Page, make


def made_with_details(tmp_path, details):
    folder = report_data.write(tmp_path / "tune", report_data.tune())
    (folder / "details.json").write_text(json.dumps(details))
    return Page(report.write_report([folder], tmp_path / "page.html"))


def test_gains_and_errors_are_on_the_page(tmp_path):
    made = make(tmp_path, tune=report_data.tune())
    assert made.sections() == ["short", "tuning", "origin"]
    assert "cost on the training trajectory from 5.00 to 3.00" in made.text
    assert "by −30 % to +5 %" in made.text
    # Errors of a joint, before and after; a gain and its factor.
    assert "4.00 → 2.40" in made.text
    assert "3.6e+05× 0.60" in made.text
    # An older study has no data for charts, and the page says so.
    assert not made.all("div", role="img")
    assert "has no data for charts" in made.text


def test_charts_are_drawn_where_their_data_are(tmp_path):
    made = made_with_details(tmp_path, report_data.tune_details())
    drawn = [found["data-chart"] for found in made.all("div", role="img")]
    assert drawn == [
        "tuning-history",
        "tuning-importance",
        "tuning-sines-and-steps",
        "tuning-chirp",
        "tuning-postures",
    ]
    assert "has no data for charts" not in made.text
    assert "right elbow flexion" in made.text


def test_few_trials_give_no_importances(tmp_path):
    details = report_data.tune_details() | {"importance": None}
    made = made_with_details(tmp_path, details)
    drawn = [found["data-chart"] for found in made.all("div", role="img")]
    assert "tuning-importance" not in drawn
    assert "tuning-history" in drawn


def test_damaged_data_are_named(tmp_path):
    details = report_data.tune_details()
    details["trials"][2]["cost"] = "low"
    with pytest.raises(InputError, match=r"details\.json.*trials\[2\]\.cost"):
        made_with_details(tmp_path, details)
    results = report_data.tune()
    del results["best"]["trajectories"]["chirp"]
    with pytest.raises(InputError, match=r"best\.trajectories"):
        make(tmp_path, tune=results)
