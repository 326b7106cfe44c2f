"""Whether the claims hold on robots of other bodies."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import spearmanr

from drake_affetto.experiments.results import DrumResults, MirrorResults
from drake_affetto.report import wording
from drake_affetto.report.parts import Section, Statement, make_table
from drake_affetto.report.report_data import ReportData

# The scheme that is asked of each body, and what it is to reach.
_SCHEME = "transfer_default"
_GOAL = 0.9
_DRUM_GOAL = 0.95
# So many of the numbers that depart are told: those that go with success most.
_TOLD = 6


def make(data: ReportData) -> Section | None:
    """The section; None if no study had a robot a repeat."""
    results = data.results("bodies")
    drum = data.results("drum_bodies")
    if results is None:
        return None
    count = max(results.samples)
    rows = [
        [
            wording.scheme(name, full=True),
            *(_share(results, name, n) for n in results.samples),
        ]
        for name in wording.ordered(results.schemes)
    ]
    schemes = make_table(
        ("scheme", *(f"{n} samples" for n in results.samples)),
        rows,
        f"Bodies on which a scheme reached {wording.percent(_GOAL)} or more, "
        "and over all bodies the least, the median and the mean success.",
        free=True,
        show_caption=True,
    )
    tables = [schemes]
    if _SCHEME in results.schemes:
        per_body = results.schemes[_SCHEME][count].per_repeat
        tables.append(
            make_table(
                ("what departs", "rank correlation with success", "p"),
                _related(results.bodies, per_body),
                f"What goes with success of {wording.in_text(_SCHEME)} after "
                f"{wording.number(count, 'sample')}, strongest first. Of "
                f"{len(results.bodies[0])} numbers that were tried one in "
                "twenty has p below 0.05 by chance.",
                free=True,
                show_caption=True,
            )
        )
    return Section(
        "bodies",
        "Other bodies",
        "Does it hold for robots of other bodies?",
        {
            "count": wording.number(len(results.bodies), "robot"),
            "statements": [
                _statement(results, count),
                *([] if drum is None else [_drum_statement(drum)]),
            ],
            "tables": tables,
        },
        (),
    )


def _share(results: MirrorResults, name: str, n: int) -> str:
    per_body = np.array(results.schemes[name][n].per_repeat)
    good = int(np.sum(per_body >= _GOAL))
    return (
        f"{good} of {len(per_body)}\n{wording.percent(per_body.min())}, "
        f"{wording.percent(float(np.median(per_body)))}, "
        f"{wording.percent(per_body.mean())}"
    )


def _related(
    bodies: Sequence[Mapping[str, float]], per_body: Sequence[float]
) -> list[list[str]]:
    """The numbers that go with success most closely."""
    found = []
    for name in bodies[0]:
        values = [body[name] for body in bodies]
        if np.ptp(values) == 0.0 or np.ptp(per_body) == 0.0:
            continue
        r, p = spearmanr(values, per_body)
        found.append((abs(r), name, r, p))
    found.sort(reverse=True)
    return [
        [name.replace("_", " ").replace(".", ": "), f"{r:+.2f}", f"{p:.3f}"]
        for _, name, r, p in found[:_TOLD]
    ] or [["–", "–", "–"]]


def _drum_statement(drum: DrumResults) -> Statement:
    """How many bodies learned to drum, the drum seen directly."""
    last = drum.by_demonstrations[-1]
    good = sum(each >= _DRUM_GOAL for each in last.per_repeat)
    return Statement(
        "equal",
        "Seen directly",
        f"After {wording.number(last.n, 'demonstration')} "
        f"{wording.percent(_DRUM_GOAL)} or more of the unseen positions were "
        f"hit on {good} of {len(last.per_repeat)} bodies, "
        f"{wording.rate(last.success_rate)} over all.",
    )


def _statement(results: MirrorResults, count: int) -> Statement:
    if _SCHEME not in results.schemes:
        return Statement("equal", "Results", "Our default was not tried.")
    per_body = results.schemes[_SCHEME][count].per_repeat
    good = sum(each >= _GOAL for each in per_body)
    text = (
        f"With {wording.number(count, 'sample')} {wording.in_text(_SCHEME)} "
        f"reached {wording.percent(_GOAL)} or more on {good} of "
        f"{len(per_body)} bodies."
    )
    worst = [i for i, each in enumerate(per_body) if each < _GOAL]
    if worst:
        named = wording.joined(
            [f"{i} ({wording.percent(per_body[i])})" for i in worst[:8]]
        )
        text += f" Below that: bodies number {named}."
    return Statement("transfer", "Results", text)
