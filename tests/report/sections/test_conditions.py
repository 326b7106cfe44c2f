"""The section on when transfer wins."""

from drake_affetto.report.charts.conditions import advantage
from support import report_data
from support.report_page import make, typed


def test_conditions_say_where_transfer_is_behind(tmp_path):
    results = report_data.conditions()
    for row in results["conditions"]:
        if row["value"] == "spread" and row["scheme"] != "relearn":
            row["success_rate"] = {"mean": 0.1, "low": 0.05, "high": 0.15}
    made = make(tmp_path, conditions=results)
    assert "(behind: positions spread, 5 demonstrations)" in made.text
    heat = advantage(typed(results).conditions, "transfer_default", "relearn")
    assert min(v for row in heat.figure.data[0].z for v in row if v) < -20
