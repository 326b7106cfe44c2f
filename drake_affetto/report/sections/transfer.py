"""The schemes of transfer in one changed view (paper Fig. 5)."""

import dataclasses

from drake_affetto.report import wording
from drake_affetto.report.charts import transfer as charts
from drake_affetto.report.comparison import SchemeComparison
from drake_affetto.report.parts import Section, Statement, in_pairs
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.sections import transfer_evidence as evidence
from drake_affetto.report.style import DARK, LIGHT, scheme_color
from drake_affetto.report.wording import conclude


def make(data: ReportData) -> Section | None:
    """The section; None if no schemes were compared."""
    comparison = data.comparison
    if comparison is None:
        return None
    in_mirror = comparison.scenario == "mirror"
    drawn = [charts.success_by_scheme(comparison)]
    rewards = charts.rewards_by_scheme(comparison)
    if rewards:
        drawn.append(rewards)
    matrices = []
    if comparison.tested:
        matrices = [
            charts.significance(comparison, n) for n in comparison.samples
        ]
    maps, scheme, count = [], "", ""
    if comparison.map:
        maps = charts.transfer_map(comparison.map)
        scheme = wording.in_text(comparison.map.scheme)
        count = wording.number(comparison.map.samples, "demonstration")
    conclusions = [conclude(comparison, n) for n in comparison.samples]
    statements = [
        Statement(each.winner, each.head, each.text) for each in conclusions
    ]
    results = data.results("mirror")
    tables = []
    chance = ""
    if results is not None and comparison.scenario == results.scenario:
        chance = evidence.chance_sentence(results.chance)
        known = evidence.knowledge_statement(results)
        statements += [known] if known is not None else []
        tables = [
            table
            for table in (
                evidence.primary_table(results),
                evidence.landing_table(results),
            )
            if table is not None
        ]
    return Section(
        "mirror",
        "Through the mirror" if in_mirror else "Seen otherwise",
        ("Through the mirror" if in_mirror else "Seen otherwise")
        + ": which scheme carries over?",
        {
            "in_mirror": in_mirror,
            "scenario": wording.scenario(comparison.scenario),
            "statements": statements,
            "chance": chance,
            "tables": tables,
            "untested": not comparison.tested and comparison.trials > 0,
            "trials": comparison.trials,
            "trials_text": wording.number(comparison.trials, "trial"),
            "charts": in_pairs(drawn),
            "key": _key(comparison),
            "matrices": matrices,
            "maps": in_pairs(maps),
            "map_scheme": scheme,
            "map_samples": count,
        },
        (*drawn, *matrices, *maps),
    )


@dataclasses.dataclass(frozen=True)
class KeyEntry:
    """A scheme with its colors and meaning.

    Attributes:
        name: Name of the scheme.
        meaning: What it does.
        light: Color on a light page.
        dark: Color on a dark page.
    """

    name: str
    meaning: str
    light: str
    dark: str


def _key(comparison: SchemeComparison) -> list[KeyEntry]:
    dark = {LIGHT[name]: DARK[name] for name in LIGHT}
    entries = []
    for name in wording.ordered(comparison.rates):
        color = scheme_color(name)
        _, _, meaning = wording.SCHEMES.get(name, ("", "", ""))
        entries.append(
            KeyEntry(
                wording.scheme(name, full=True), meaning, color, dark[color]
            )
        )
    return entries
