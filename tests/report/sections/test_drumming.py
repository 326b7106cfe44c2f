"""The section on drumming."""

from support import report_data
from support.report_page import make


def test_results_of_figures_are_on_the_page(tmp_path):
    results = report_data.drum(active=True)
    made = make(tmp_path, drum=results)
    hits = sum(row["success"] for row in results["final"]["positions"])
    assert hits == 29
    assert "29 of 30" in made.text
    chosen = results["active"]["n_to_90"]
    assert f"after {chosen} rather than {results['n_to_90']}" in made.text
    assert "0 hits not heard (area under the curve 1.000)" in made.text


def test_active_choice_that_does_not_help_is_said_so(tmp_path):
    results = report_data.drum()
    results["active"]["n_to_90"] = results["n_to_90"] + 2
    made = make(tmp_path, drum=results)
    assert "least certain did not help" in made.text
    results["active"]["n_to_90"] = None
    assert "Only the random order came to stay" in (
        make(tmp_path, drum=results).text
    )
    results["active"] = None
    made = make(tmp_path, drum=results)
    assert "least certain" not in made.text
    results["n_to_90"] = None
    made = make(tmp_path, drum=results)
    assert "Success did not come to stay at 90 %" in made.text
