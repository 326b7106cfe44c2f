"""Where the numbers come from."""

from pathlib import Path

from drake_affetto.report import wording
from drake_affetto.report.parts import Section, make_table
from drake_affetto.report.report_data import ReportData

_STUDIES = {
    "demo": "the whole story once, at small scale",
    "drum": "success over the number of demonstrations",
    "mirror": "the schemes in one changed view, with statistics",
    "bodies": "the schemes on robots of other bodies",
    "self_calibration": "the robot that finds the mirror by itself",
    "drum_bodies": "learning to drum on robots of other bodies",
    "scenarios": "the schemes in all changed views",
    "conditions": "when transfer wins",
    "toy": "the paper's toy experiment",
    "tune": "search for the controllers' gains",
}


def make(data: ReportData) -> Section:
    """The section, a row for each study."""
    rows = []
    for name, folder in data.folders.items():
        results = folder.results
        size = [
            f"{getattr(results, key)} {key}"
            for key in ("repeats", "evaluations", "seeds", "trials")
            if isinstance(getattr(results, key, None), int)
        ]
        if name == "scenarios":
            size.append(wording.number(len(results.scenarios), "view"))
        if name == "tune":
            size.append(wording.number(results.trials.finished, "trial"))
        rows.append(
            [
                name,
                _STUDIES[name],
                # Not the whole path: the page may be sent to others.
                Path(*folder.folder.parts[-2:]).as_posix(),
                results.version,
                results.seed,
                ", ".join(size) or "–",
            ]
        )
    table = make_table(
        ("study", "what", "folder", "version", "seed", "size"),
        rows,
        "Where the numbers come from",
        free=True,
        stacked=True,
    )
    return Section(
        "origin", "Origin", "Where this comes from", {"table": table}
    )
