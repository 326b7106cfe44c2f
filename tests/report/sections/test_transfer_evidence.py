"""Chance, tests named beforehand, landing and knowledge, on the page."""

from drake_affetto.experiments.results import SuccessRate
from drake_affetto.report.sections import transfer_evidence as evidence
from support import report_data
from support.report_page import make, typed


def test_the_page_tells_what_stands_behind_the_rates(tmp_path):
    page = make(tmp_path, mirror=report_data.mirror())
    assert "played without looking, was heard in 17 % (10" in page.text
    assert "What is known beforehand" in page.text
    for known in ("(1°)", "(5 mm)", "(1 %)", "(3 mm)"):
        assert known in page.text
    # What is known exactly is not among what is known wrongly.
    assert "the neck's posture" not in page.text
    assert "corrected for these comparisons" in page.text
    assert "-21 mm from the middle" in page.text
    assert "0.012" in page.text
    assert "10 mm" in page.text
    assert "5 % grazes" in page.text


def test_only_what_was_named_beforehand_is_in_the_table():
    table = evidence.primary_table(typed(report_data.mirror()))
    assert [row[1].value for row in table.rows] == ["3"]
    none = report_data.mirror()
    for row in none["comparisons"]:
        row["primary"] = False
    assert evidence.primary_table(typed(none)) is None


def test_what_was_not_measured_is_not_shown():
    results = report_data.mirror()
    for cells in results["schemes"].values():
        for cell in cells.values():
            del cell["landing"], cell["grazes"]
    results["knowledge"] = {}
    del results["chance"]
    results = typed(results)
    assert evidence.landing_table(results) is None
    assert evidence.knowledge_statement(results) is None
    assert evidence.chance_sentence(results.chance) == ""


def test_exact_knowledge_is_said_to_be_exact():
    results = report_data.mirror()
    results["knowledge"] = dict.fromkeys(results["knowledge"], 0.0)
    text = evidence.knowledge_statement(typed(results)).text
    assert "Here it knows them exactly." in text


def test_chance_has_its_interval():
    text = evidence.chance_sentence(SuccessRate(0.25, 0.1, 0.4))
    assert "25" in text
    assert "10" in text
