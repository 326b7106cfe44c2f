"""The section on the robot that finds the mirror by itself."""

import copy

import pytest

from drake_affetto import report
from support import report_data
from support.report_page import Page, make

RATE = {"mean": 0.9, "low": 0.8, "high": 0.95}
PLANE = {
    "parameters": [-1.9, -0.2, 0.3],
    "covariance": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-5]],
    "angle_error": 0.6,
    "offset_error": 3.0,
    "covered": True,
    "looks": 9,
    "strokes": 0,
}


def method(mean):
    return {
        "success_rate": RATE | {"mean": mean},
        "per_repeat": [mean],
        "looks": 9.0,
        "strokes": 0.0,
        "angle_error": 0.6,
        "offset_error": 3.0,
        "coverage": RATE,
        "planes": [PLANE],
    }


def results():
    line = [[0.1, 0.3], [0.6, 0.2]]
    return report_data.mirror() | {
        "self_calibration": {
            "repeats": 1,
            "evaluations": 8,
            "rotation": 5.0,
            "translation": 0.03,
            "methods": {
                "hand": method(0.94),
                "ellipse": method(0.91),
                "ear": method(0.85),
            },
            "by_ear": [
                {
                    "start": "prior",
                    "by_stroke": [0.1, 0.9],
                    "late": RATE,
                    "late_from": 13,
                    "late_to": 24,
                    "chance": RATE | {"mean": 0.14, "low": 0.1},
                }
            ],
            "watch": {
                "turned_by": 5.0,
                "turned_after": 10,
                "delays": [4],
                "noticed": RATE | {"mean": 1.0, "high": 1.0},
                "false_alarms": 0,
                "quiet_strokes": 10,
                "recovered": RATE,
                "quiet_looks": 1,
                "noticed_by_strokes": RATE | {"mean": 0.4, "low": 0.1},
                "false_alarms_by_strokes": 2,
            },
            "beliefs": [
                {"method": "ear", "step": 0, "lines": [line, line]},
                {"method": "ear", "step": 24, "lines": [line]},
                {"method": "hand", "step": 5, "lines": [line]},
                {"method": "hand", "step": 9, "lines": [line]},
            ],
            "true_line": line,
        }
    }


def drawn(made):
    return [found["data-chart"] for found in made.all("div", role="img")]


def test_the_page_tells_what_it_took(tmp_path):
    made = make(tmp_path, mirror=results())
    assert "self_calibration" in made.sections()
    assert {"self-calibration", "belief"} <= set(drawn(made))
    for words in (
        "No demonstration at all",
        "its hand in the mirror",
        "94 %",
        "0.6°, 3 mm",
        "strokes 13 to 24",
        "it so noticed within six strokes in 100 %",
        "somewhere on my left",
        "took 10 looks in a hundred strokes",
        "Strokes alone would have told in 40 %",
    ):
        assert words in made.text, words


def test_without_it_there_is_no_section(tmp_path):
    made = make(tmp_path, mirror=report_data.mirror())
    assert "self_calibration" not in made.sections()


@pytest.mark.parametrize("missing", ["beliefs", "watch", "by_ear"])
def test_parts_may_be_missing(tmp_path, missing):
    plain = copy.deepcopy(results())
    del plain["self_calibration"][missing]
    made = make(tmp_path, mirror=plain)
    assert "self_calibration" in made.sections()
    assert ("belief" in drawn(made)) == (missing != "beliefs")


def test_it_stands_beside_the_schemes_with_demonstrations(tmp_path):
    made = make(tmp_path, mirror=report_data.mirror(), by_itself=results())
    assert {"mirror", "self_calibration"} <= set(made.sections())
    alone = make(tmp_path / "alone", by_itself=results())
    assert "mirror" not in alone.sections()
    assert "Affetto finds the mirror by itself" in alone.text
    # The headline numbers.
    assert "without a demonstration, by its hand in the mirror" in alone.text
    assert "of mirrors turned by 5° noticed" in alone.text


def test_its_replay_waits_until_it_is_asked_for(tmp_path):
    folder = report_data.write(tmp_path / "s", results())
    (folder / "self_calibration.html").write_text(report_data.REPLAY)
    made = Page(report.write_report([folder], tmp_path / "page.html"))
    (stage,) = made.all("div", **{"class": "stage"})
    assert stage["data-replay"] == "self_calibration"
    assert "self_calibration" in {each.get("id") for each in made.all("script")}
    # Its media are not those of the section on trials.
    assert "seen" not in made.sections()
