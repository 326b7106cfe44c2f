"""No demonstration at all: the robot finds the mirror by itself."""

from drake_affetto.experiments.results.self_calibration import (
    REPLAY,
    MethodResult,
    SelfCalibrationResults,
)
from drake_affetto.report import wording
from drake_affetto.report.charts.self_calibration import (
    demonstrations_needed,
    shrinking_belief,
)
from drake_affetto.report.parts import Section, Table, make_table
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.sections.media import make_replay


def make(data: ReportData) -> Section | None:
    """The section; None if the robot was not asked to."""
    folder = data.folders.get("self_calibration")
    if folder is None:
        return None
    results = folder.results
    found = results.self_calibration
    replay = folder.media.get(REPLAY)
    charts = [
        chart
        for chart in (
            demonstrations_needed(results, found),
            shrinking_belief(found),
        )
        if chart is not None
    ]
    return Section(
        "self_calibration",
        "By itself",
        "No demonstration at all",
        {
            "rotation": f"{found.rotation:g}",
            "translation": f"{100 * found.translation:g}",
            "table": _table(found),
            "strokes": _strokes(found),
            "watch": _watch(found),
            "bodies": len(results.bodies),
            "replay": None
            if replay is None
            else make_replay(replay, "3D replay of looks at the hand"),
            "charts": charts,
        },
        tuple(charts),
    )


def _table(found: SelfCalibrationResults) -> Table:
    return make_table(
        ("by", "success", "looks", "own strokes", "plane off by", "covered"),
        [
            [
                wording.METHODS.get(name, name),
                wording.rate(method.success_rate),
                f"{method.looks:.1f}",
                f"{method.strokes:.0f}",
                _off(method),
                "–"
                if method.coverage is None
                else wording.percent(method.coverage.mean),
            ]
            for name, method in found.methods.items()
        ],
        "What it took to find the mirror, and how exactly it is then known; "
        "covered: share of mirrors within the stated region of 95 %",
        show_caption=True,
    )


def _off(method: MethodResult) -> str:
    if method.angle_error is None or method.offset_error is None:
        return "–"
    return f"{method.angle_error:.1f}°, {method.offset_error:.0f} mm"


def _strokes(found: SelfCalibrationResults) -> str:
    begins = {
        "ellipse": "From what the ellipse tells",
        "prior": "From “somewhere on my left”",
    }
    return " ".join(
        f"{begins.get(each.start, each.start)}, strokes {each.late_from} to "
        f"{each.late_to} by ear were heard in {wording.rate(each.late)}; "
        f"without listening {wording.rate(each.chance)}."
        for each in found.by_ear
    )


def _watch(found: SelfCalibrationResults) -> str:
    watch = found.watch
    if watch is None:
        return ""
    rate = wording.rate(watch.noticed)
    looks = f"{100 * watch.quiet_looks / max(1, watch.quiet_strokes):.0f}"
    alarms = wording.number(watch.false_alarms, "false alarm")
    text = (
        "After a stroke that should have been heard and was not, the robot "
        "looks at its hand again. When the mirror was turned by "
        f"{watch.turned_by:g}°, it so noticed within six strokes in {rate} of "
        f"the repeats, with {alarms} in {watch.quiet_strokes} strokes before "
        f"unmoved mirrors, which took {looks} looks in a hundred strokes."
    )
    if watch.noticed_by_strokes is not None:
        alone = wording.rate(watch.noticed_by_strokes)
        alarms = wording.number(watch.false_alarms_by_strokes, "false alarm")
        text += f" Strokes alone would have told in {alone}, with {alarms}."
    if watch.recovered is not None:
        text += (
            " After looking at its hand again it hit in "
            f"{wording.rate(watch.recovered)}."
        )
    return text
