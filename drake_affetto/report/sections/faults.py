"""What faults do to the robot, and whether it notices them."""

from drake_affetto.experiments.results import FaultRow, FaultsResults
from drake_affetto.report import wording
from drake_affetto.report.parts import Section, Statement, Table, make_table
from drake_affetto.report.report_data import ReportData


def make(data: ReportData) -> Section | None:
    """The section; None if the study was not run."""
    results = data.results("faults")
    if results is None:
        return None
    return Section(
        "faults",
        "Faults",
        "When something fails",
        {
            "statements": [_statement(results)],
            "table": _table(results.rows),
            "sound": _sound(results),
        },
        (),
    )


def _statement(results: FaultsResults) -> Statement:
    detected = sum(row.detected for row in results.rows)
    harmed = sum(row.harmed for row in results.rows)
    good = not (results.false_success or results.missed or results.beyond_limit)
    text = (
        f"{detected} were noticed and ended as not valid. "
        "Heard as a hit without contact of hand and head: "
        f"{results.false_success}. Of {harmed} in which the fault changed the "
        f"outcome, {results.missed} went unnoticed. A force above "
        f"{results.force_limit:g} N came up in {results.beyond_limit} trials."
    )
    return Statement(
        "transfer" if good else "other",
        f"{results.faulted} trials with a fault",
        text,
    )


def _sound(results: FaultsResults) -> str:
    sound = results.sound
    success = (
        ""
        if sound.success is None
        else f"; of the others {wording.rate(sound.success)} hit"
    )
    return (
        f"The same {sound.trials} trials without a fault: "
        f"{wording.number(sound.false_alarms, 'false alarm')}{success}."
    )


def _table(rows: list[FaultRow]) -> Table:
    return make_table(
        (
            "fault",
            "size",
            "trials",
            "success",
            "false success",
            "noticed",
            "after, s",
            "changed unnoticed",
            "force, N",
            "speed, rad/s",
        ),
        [
            [
                row.kind.replace("_", " "),
                "–" if row.size is None else f"{row.size:g} {row.unit}",
                str(row.trials),
                str(row.success),
                str(row.false_success),
                str(row.detected),
                "–"
                if row.detection_time is None
                else f"{row.detection_time:.2f}",
                str(row.missed),
                f"{row.max_force:.1f}",
                f"{row.max_speed:.1f}",
            ]
            for row in rows
        ],
        "Faults and their sizes: counts of trials; the median time from a "
        "fault's beginning until it is noticed; greatest contact force and "
        "joint speed",
        show_caption=True,
    )
