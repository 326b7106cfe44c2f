"""Charts over conditions."""

from drake_affetto.report.charts.conditions import condition_charts
from support import report_data
from support.report_page import typed


def test_conditions_are_drawn_over_values_and_over_samples():
    charts = condition_charts(typed(report_data.conditions()).conditions)
    assert [chart.title for chart in charts] == [
        "Teacher",
        "Teacher: as taught",
        "Workspace",
        "Positions",
    ]
    over_samples = charts[1].figure
    assert list(over_samples.layout.xaxis.ticktext) == [
        *("3", "4", "5", "8", "12")
    ]
    # Over the teacher, all values with the same number of samples.
    assert {row[2] for row in charts[0].rows} == {5}
