"""The tuning of the controllers' gains."""

from drake_affetto.common.typed_json import from_plain
from drake_affetto.report import wording
from drake_affetto.report.charts import tuning as charts
from drake_affetto.report.parts import Section, Table, make_table
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.study_folder import StudyFolder, read_json
from drake_affetto.tuning.config import HELD_OUT, TRAINING
from drake_affetto.tuning.results import (
    DETAILS_FILE,
    TuningDetails,
    TuningResults,
)


def make(data: ReportData) -> Section | None:
    """The section; None if no gains were tuned.

    Raises:
        InputError: If the file of the charts' data is damaged.
    """
    folder = data.folders.get("tune")
    if folder is None:
        return None
    results: TuningResults = folder.results
    details = _details(folder)
    drawn = []
    if details is not None:
        drawn.append(charts.history(details, results))
        if details.importance is not None:
            drawn.append(charts.importance(details.importance))
        drawn += [
            charts.traces(name, traces)
            for name, traces in details.references.items()
        ]
    return Section(
        "tuning",
        "Gains",
        "Tuned gains",
        {
            "text": wording.tuning_gain(results) + ".",
            "errors": _error_table(results),
            "gains": _gain_table(results),
            "charts": drawn,
            "trials": results.trials,
        },
        tuple(drawn),
    )


def _details(folder: StudyFolder) -> TuningDetails | None:
    """The data of the charts; None for a study of an earlier version."""
    path = folder.folder / DETAILS_FILE
    if not path.is_file():
        return None
    return from_plain(TuningDetails, read_json(path), f"{path}: ")


def _error_table(results: TuningResults) -> Table:
    columns = (TRAINING, *HELD_OUT)
    rows = []
    for joint in results.hand_tuned.gains:
        row = [charts.label(joint)]
        for name in columns:
            before, after = (
                side.trajectories[name].tracking_error_deg[joint]
                for side in (results.hand_tuned, results.best)
            )
            row.append(f"{before:.2f} → {after:.2f}")
        before, after = (
            side.rest_oscillation_percent[joint]
            for side in (results.hand_tuned, results.best)
        )
        rows.append([*row, f"{before:.2f} → {after:.2f}"])
    return make_table(
        ("joint", *(charts.TITLES[name] for name in columns), "at rest, %"),
        rows,
        "Rms tracking error, degrees: with the hand-tuned gains → with the "
        "tuned ones. At rest: the greatest standard deviation of the angle in "
        "any of several postures, in % of the joint's range.",
        show_caption=True,
    )


def _gain_table(results: TuningResults) -> Table:
    names = ("kP", "kI", "kD", "kF")
    rows = []
    for joint, gains in results.best.gains.items():
        start = results.hand_tuned.gains[joint]
        factors = [
            f"× {gains[name] / start[name]:.2f}" if start[name] else "–"
            for name in names
        ]
        rows.append(
            [
                charts.label(joint),
                *(
                    f"{gains[name]:.3g}\n{factor}"
                    for name, factor in zip(names, factors, strict=True)
                ),
            ]
        )
    return make_table(
        ("joint", "kP, Pa/rad", "kI, Pa/(rad s)", "kD, Pa s/rad", "kF, 1/Pa"),
        rows,
        "The gains; in small letters their ratio to the hand-tuned ones.",
        show_caption=True,
    )
