"""What stands behind the schemes' rates: chance, tests, landing, knowledge."""

import math

import numpy as np

from drake_affetto.experiments.results import (
    MirrorResults,
    SchemeComparisonRow,
    SuccessRate,
)
from drake_affetto.report import wording
from drake_affetto.report.parts import Statement, Table, make_table


def chance_sentence(chance: SuccessRate | None) -> str:
    """What a robot reaches that does not look; empty if it was not tried."""
    if chance is None:
        return ""
    return (
        "Chance: the one demonstrated stroke that suits most places, played "
        f"without looking, was heard in {wording.rate(chance)}."
    )


def primary_table(results: MirrorResults) -> Table | None:
    """The comparisons that were named before the study; None without any."""
    rows = [_primary_row(row) for row in results.comparisons if row.primary]
    if not rows:
        return None
    return make_table(
        ("comparison", "samples", "difference", "corrected p"),
        rows,
        "What the study was made to decide, named before it was run: each "
        "transfer against relearning. p is corrected for these comparisons "
        "(Holm); all others are secondary.",
        free=True,
        show_caption=True,
    )


def _primary_row(row: SchemeComparisonRow) -> list[str]:
    landing = row.measure == "landing"
    if landing:
        size = f"{1e3 * row.difference:+.0f} mm from the middle"
    else:
        size = f"{100 * row.difference:+.0f} points of success"
    p = row.p_corrected
    return [
        f"{wording.scheme(row.a)} against {wording.scheme(row.b)}",
        str(row.samples),
        size,
        "–" if p is None else f"{p:.3f}" if p >= 0.001 else "under 0.001",
    ]


def landing_table(results: MirrorResults) -> Table | None:
    """Where strokes land, by scheme; None if it was not measured."""
    rows = []
    for name in wording.ordered(results.schemes):
        row = [wording.scheme(name, full=True)]
        for n in results.samples:
            cell = results.schemes[name][n]
            known = [each for each in cell.landing if each is not None]
            if not known or cell.grazes is None:
                row.append("–")
                continue
            middle = 1e3 * float(np.median(known))
            grazes = wording.percent(cell.grazes)
            row.append(f"{middle:.0f} mm\n{grazes} grazes")
        rows.append(row)
    if all(cell == "–" for row in rows for cell in row[1:]):
        return None
    return make_table(
        ("scheme", *(f"{n} samples" for n in results.samples)),
        rows,
        "Where the palm comes down, from the middle of the head (median; its "
        "radius is 37 mm, that of the hand 28). Success saturates, this does "
        "not. A graze sounds the head although the palm comes down beside "
        "it; by its sound it counts as a hit.",
        free=True,
        show_caption=True,
    )


# What each error of the knowledge is of, and how it is written.
_KNOWLEDGE = {
    "angle": ("the camera's orientation", math.degrees(1.0), "°"),
    "position": ("its place", 1e3, " mm"),
    "focal": ("its focal length", 100.0, " %"),
    "height": ("the height of the marker", 1e3, " mm"),
    "neck": ("the neck's posture", math.degrees(1.0), "°"),
}


def knowledge_statement(results: MirrorResults) -> Statement | None:
    """What the optical map is told beforehand; None if it was not used."""
    if not results.knowledge:
        return None
    wrong = wording.joined(
        [
            f"{what} ({scale * results.knowledge[key]:.2g}{unit})"
            for key, (what, scale, unit) in _KNOWLEDGE.items()
            if results.knowledge.get(key, 0.0) > 0.0
        ]
    )
    text = (
        "The optical map of our default knows the camera, how the trunk turns "
        "it, the height of the drum's marker, and about where a mirror may "
        "stand; it learns the mirror's plane, three numbers. "
    )
    if wrong:
        text += "As on a real robot it knows them wrongly, anew each repeat: "
    text += f"{wrong}. " if wrong else "Here it knows them exactly. "
    text += (
        "Transfer with an affine map knows none of it. The other schemes "
        "scale their inputs by the range that the region covers in the new "
        "view, which was measured by looking at drums along its border."
    )
    return Statement("equal", "What is known beforehand", text)
