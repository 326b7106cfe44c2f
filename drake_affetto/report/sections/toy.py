"""The toy experiment (paper Fig. 2)."""

from drake_affetto.experiments.results import ToyResults
from drake_affetto.experiments.toy import BASELINES, TRANSFERS
from drake_affetto.report import wording
from drake_affetto.report.charts.toy import toy_errors
from drake_affetto.report.parts import Section, Statement
from drake_affetto.report.report_data import ReportData


def make(data: ReportData) -> Section | None:
    """The section; None if the toy experiment was not run."""
    results = data.results("toy")
    if results is None:
        return None
    labels = {"transfer": TRANSFERS, "baselines": BASELINES}
    paper = results.paper.transfer.other_mse_mean
    charts = [
        toy_errors(
            results, labels, key="toy-unit", square="[0, 1]²", paper=paper
        )
    ]
    if results.wide is not None:
        charts.append(
            toy_errors(
                results.wide,
                labels,
                key="toy-wide",
                square="[−1.3, 1.3]²",
                paper=None,
            )
        )
    errors = {
        labels[group].get(name, name): row.other_mse_mean
        for group in ("transfer", "baselines")
        for name, row in getattr(results, group).items()
        if name != "true_map"
    }
    best = min(errors, key=lambda label: errors[label])
    text = wording.toy_gain(results) + (
        f"; {_paper_way(results)} "
        f"Best of all without knowing h: {best}, {errors[best]:.2g}"
    )
    return Section(
        "toy",
        "Toy",
        "The idea on a toy problem",
        {
            "rotated": f"{results.source.rotated_mse:.3g}",
            "tested": f"{results.source.test_mse:.2g}",
            "statements": [
                Statement(
                    "other" if best in BASELINES.values() else "transfer",
                    f"{wording.number(results.seeds, 'seed')} with "
                    f"{wording.number(results.repeats, 'choice')} of five "
                    "points each",
                    wording.sentence(text),
                )
            ],
            "charts": charts,
            "function": results.function,
        },
        tuple(charts),
    )


def _paper_way(results: ToyResults) -> str:
    """What the paper's transfer gives here and there."""
    paper = results.paper.transfer
    printed = f"{paper.other_mse_mean:g} ± {paper.other_mse_std:g}"
    ours = results.transfer.get("paper")
    if ours is None:
        return f"the paper has {printed}."
    return (
        f"the paper's way comes to {ours.other_mse_mean:.2g} ± "
        f"{ours.other_mse_std:.2g} (paper: {printed})."
    )
