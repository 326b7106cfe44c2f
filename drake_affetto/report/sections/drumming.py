"""Learning to drum, the drum seen directly (paper Fig. 3)."""

from drake_affetto.experiments.results import (
    DrumResults,
    RewardEvaluation,
    TaughtPosition,
)
from drake_affetto.report import wording
from drake_affetto.report.charts import drumming as charts
from drake_affetto.report.parts import Section, Statement, in_pairs
from drake_affetto.report.report_data import Drumming, ReportData
from drake_affetto.report.sections import transfer_evidence as evidence
from drake_affetto.sound.reward import SUCCESS_THRESHOLD


def make(data: ReportData) -> Section | None:
    """The section; None if the drum was not seen directly."""
    drumming = data.drumming
    if drumming is None:
        return None
    results = data.results("drum")
    threshold = results.separation.threshold if results else SUCCESS_THRESHOLD
    drawn = []
    if results:
        drawn.append(
            charts.learning_curve(
                results.by_demonstrations,
                results.active.by_demonstrations if results.active else None,
                evaluations=results.evaluations,
                repeats=results.repeats,
            )
        )
    positions = (drumming.taught, drumming.tests, threshold)
    drawn.append(charts.workspace(*positions))
    if results and results.similarity:
        traces = results.similarity
        drawn.append(
            charts.similarity(traces.t, traces.hit, traces.miss, threshold)
        )
    if results and results.rewards:
        drawn.append(
            charts.separation(
                results.rewards, threshold, results.separation.impulse_threshold
            )
        )
    seen = charts.task_space(*positions)
    if seen is not None and len(drawn) % 2:
        drawn.insert(1 + len(drawn) // 2, seen)
    statement = Statement("transfer", "Results", _sentences(drumming, results))
    return Section(
        "drum",
        "Learning to drum",
        "Learning to drum, the drum seen directly",
        {
            "demonstrations": wording.number(
                drumming.demonstrations, "demonstration"
            ),
            "statements": [statement],
            "charts": in_pairs(drawn),
        },
        tuple(drawn),
    )


def _sentences(drumming: Drumming, results: DrumResults | None) -> str:
    parts = [_hits(drumming), *_misses(drumming), *_teaching(drumming)]
    if results:
        parts += [*_orders(results), _reward(results.separation)]
        parts.append(evidence.chance_sentence(results.chance).rstrip("."))
    return " ".join(wording.sentence(part) for part in parts if part)


def _hits(drumming: Drumming) -> str:
    text = (
        f"{drumming.hits} of {len(drumming.tests)} unseen positions were hit "
        f"after {wording.number(drumming.demonstrations, 'demonstration')}"
    )
    if drumming.repeats > 1:
        text += (
            f" ({wording.number(drumming.repeats, 'repeat')} of "
            f"{drumming.per_repeat} positions)"
        )
    return text


def _misses(drumming: Drumming) -> list[str]:
    """At which places the drum was missed, and how often."""
    missed: dict[tuple[float, float], int] = {}
    for test in drumming.tests:
        if not test.success:
            place = (round(test.xy[0], 3), round(test.xy[1], 3))
            missed[place] = missed.get(place, 0) + 1
    if not missed:
        return []
    named = [
        f"({100 * x:.1f}, {100 * y:.1f}) cm {wording.number(count, 'time')}"
        for (x, y), count in sorted(missed.items(), key=lambda item: -item[1])
    ]
    return [f"the drum was missed at {wording.joined(named[:8])}"]


def _teaching(drumming: Drumming) -> list[str]:
    parts = []
    if drumming.taught:
        first = sum(row.attempts == 1 for row in drumming.taught)
        parts.append(
            f"{wording.percent(first / len(drumming.taught))} of "
            "demonstrations made a sound at the first try"
        )
    pulls = [
        row.max_pull
        for row in drumming.taught
        if isinstance(row, TaughtPosition) and row.max_pull is not None
    ]
    if pulls:
        parts.append(
            f"the teacher's hand never pulled with more than {max(pulls):.0f} N"
        )
    return parts


def _orders(results: DrumResults) -> list[str]:
    """How the two orders of demonstrations compare."""
    random = results.n_to_90
    if results.active is None:
        if random is None:
            return ["success did not come to stay at 90 % or more"]
        return []
    chosen = results.active.n_to_90
    if random is None or chosen is None:
        which = {
            (True, True): "neither order",
            (True, False): "only the chosen order",
            (False, True): "only the random order",
        }[random is None, chosen is None]
        return [f"{which} came to stay at 90 % or more"]
    where = "giving the next demonstration where the skill is least certain"
    if chosen < random:
        return [
            f"{where} brings success to 90 % or more after {chosen} rather "
            f"than {random}"
        ]
    return [
        f"{where} did not help: 90 % after {chosen}, in random order after "
        f"{random}"
    ]


def _reward(separation: RewardEvaluation) -> str:
    text = (
        f"in {wording.number(separation.trials, 'trial')} there were "
        f"{separation.false_hits} successes without a hit, and "
        f"{wording.number(separation.missed_hits, 'hit')} not heard"
    )
    if separation.auc is not None:
        text += f" (area under the curve {separation.auc:.3f})"
    return text
