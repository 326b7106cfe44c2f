"""The page of a tuning study: one HTML file that needs nothing else."""

from collections.abc import Sequence
import html
import json
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from drake_affetto.common.output import write_text_atomic
from drake_affetto.tuning.config import HELD_OUT, REST, TRAINING
from drake_affetto.tuning.plan import GAINS, TunePlan, parameter_names
from drake_affetto.tuning.results import Evaluation

# Colours that can be told apart, also by the colour-blind, on light and dark.
_DESIRED, _BEFORE, _AFTER = "#888888", "#d55e00", "#0091d5"
_TRACE_RATE = 25.0

_STYLE = """
:root { color-scheme: light dark; --ink: #1d2329; --soft: #5c6670;
  --page: #ffffff; --line: #d8dde2; --card: #f5f7f9; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e8ec;
  --soft: #9aa5b0; --page: #14181c; --line: #353c44; --card: #1c2228; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 68rem; padding: 1rem;
  font: 1rem/1.5 system-ui, sans-serif; color: var(--ink);
  background: var(--page); }
h1 { font-size: 1.6rem; line-height: 1.2; }
h2 { font-size: 1.2rem; margin-top: 2.2rem; }
p, li { max-width: 44rem; }
.soft { color: var(--soft); }
.figures { display: grid; gap: 0.7rem;
  grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); }
.figures div { background: var(--card); border: 1px solid var(--line);
  border-radius: 0.5rem; padding: 0.6rem 0.8rem; }
.figures b { display: block; font-size: 1.5rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums;
  font-size: 0.9rem; white-space: nowrap; }
th, td { padding: 0.25rem 0.6rem; text-align: right;
  border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
pre { background: var(--card); border: 1px solid var(--line);
  border-radius: 0.5rem; padding: 0.7rem; overflow-x: auto;
  font-size: 0.85rem; }
.plot { width: 100%; }
select { font: inherit; padding: 0.2rem; color: var(--ink);
  background: var(--card); border: 1px solid var(--line); }
"""

# Draws the figures in the page's colours, and again where these change.
_SCRIPT = """
const figures = JSON.parse(document.getElementById("figures").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
function colours() {
  const style = getComputedStyle(document.documentElement);
  const ink = style.getPropertyValue("--ink").trim();
  const line = style.getPropertyValue("--line").trim();
  return [ink, line];
}
function dressed(layout) {
  const [ink, line] = colours();
  const copy = JSON.parse(JSON.stringify(layout));
  copy.font = {color: ink, family: "system-ui, sans-serif", size: 12};
  copy.paper_bgcolor = copy.plot_bgcolor = "rgba(0,0,0,0)";
  copy.hoverlabel = {font: {color: "#1d2329"}, bgcolor: "#f5f7f9"};
  for (const key of Object.keys(copy))
    if (/^[xy]axis/.test(key)) Object.assign(copy[key],
      {gridcolor: line, zerolinecolor: line, linecolor: line});
  return copy;
}
const config = {responsive: true, displaylogo: false, displayModeBar: false};
function draw(id, name) {
  const place = document.getElementById(id);
  const figure = figures[name];
  Plotly.react(place, figure.data, dressed(figure.layout), config);
}
function drawAll() {
  draw("history", "history");
  if (figures.importance) draw("importance", "importance");
  draw("traces", document.getElementById("reference").value);
}
document.getElementById("reference").addEventListener("change", drawAll);
dark.addEventListener("change", drawAll);
drawAll();
"""

_TITLES = {
    TRAINING: "Test trajectory: sines and steps",
    "chirp": "Held out: chirp",
    "strokes": "Held out: strokes",
    "trapezoids": "Held out: trapezoids",
    REST: "Rest at several postures",
}


def write_page(
    path: Path,
    plan: TunePlan,
    study: optuna.Study,
    results: dict[str, Any],
    evaluation: Evaluation,
) -> None:
    """Writes the page of a finished study to `path`."""
    names = list(results["hand_tuned"]["gains"])
    trials = study.get_trials(deepcopy=False)
    complete = [t for t in trials if t.state == TrialState.COMPLETE]
    importance = importances(study, plan.joints)
    figures: dict[str, Any] = {
        "history": _history(trials, results),
        **{
            name: _traces(names, evaluation, name)
            for name in (TRAINING, *HELD_OUT, REST)
        },
    }
    if importance is not None:
        figures["importance"] = _importance(plan.joints, importance)
    data = json.dumps(
        {name: json.loads(f.to_json()) for name, f in figures.items()}
    )
    # Within a script element nothing may look like its end.
    data = data.replace("</", "<\\/")
    options = "".join(
        f'<option value="{name}">{title}</option>'
        for name, title in _TITLES.items()
    )
    # Inline styles and scripts, no address: the page opens anywhere.
    text = f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Tuned gains</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>Gains of {len(plan.joints)} joints, tuned on the whole robot</h1>
{_summary(results, complete)}
<h2>Tracking error of each joint</h2>
<p>Root mean square over the trajectory, in degrees: with the hand-tuned
gains → with the tuned ones. Trials saw the test trajectory only. At rest: the
greatest standard deviation of the angle at any of several postures, in % of
the joint's range.</p>
<div class="scroll">{_error_table(results)}</div>
<h2>Before and after</h2>
<p><label>Trajectory: <select id="reference">{options}</select></label></p>
<div id="traces" class="plot"></div>
<h2>History</h2>
<p>The cost of each trial: tracking error, effort of the valves and oscillation
at rest, the mean over the joints. Trials that were far worse than the best one
at the same time were stopped.</p>
<div id="history" class="plot"></div>
<h2>Which gains matter</h2>
{_importance_text(importance)}
<div id="importance" class="plot"></div>
<h2>The gains</h2>
<p>Pa/rad, Pa/(rad s), Pa s/rad and 1/Pa; in brackets what the hand-tuned ones
were multiplied by.</p>
<div class="scroll">{_gain_table(results)}</div>
<p>The file <code>gains.yaml</code> beside this page holds them; a scenario
takes them up with</p>
<pre>control:
  overlays: [gains.yaml]</pre>
<script id="figures" type="application/json">{data}</script>
<script>{get_plotlyjs()}</script>
<script>{_SCRIPT}</script>
</body>
</html>
"""
    write_text_atomic(path, text)


def importances(
    study: optuna.Study, joints: Sequence[str]
) -> np.ndarray | None:
    """Share of each gain in what its joint's costs differ by.

    Functional ANOVA of the logarithm of each joint's own cost over its own
    gains.

    Returns:
        (joints, gains), rows that add to 1; None where there are too few
        trials to say.
    """
    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    if len(complete) < 20:
        return None
    rows = []
    for joint in joints:

        def cost(trial: FrozenTrial, joint: str = joint) -> float:
            return float(np.log(trial.user_attrs["joint_costs"][joint]))

        found = optuna.importance.get_param_importances(
            study,
            evaluator=optuna.importance.FanovaImportanceEvaluator(seed=0),
            params=parameter_names([joint]),
            target=cost,
        )
        rows.append([found[f"{joint}.{gain}"] for gain in GAINS])
    return np.array(rows)


def _label(joint: str) -> str:
    return joint.replace("_", " ")


def _summary(results: dict[str, Any], complete: list[FrozenTrial]) -> str:
    hand, best = results["hand_tuned"], results["best"]

    def mean_error(side: dict[str, Any]) -> float:
        errors = side["trajectories"][TRAINING]["tracking_error_deg"]
        return float(np.mean(list(errors.values())))

    rest = max(best["rest_oscillation_percent"].values())
    held = results["held_out_improvement"]
    trials = results["trials"]
    cells = [
        (
            f"−{results['improvement']:.0%}"
            if results["improvement"] >= 0
            else f"+{-results['improvement']:.0%}",
            f"cost on the test trajectory ({hand['cost']:.2f} → "
            f"{best['cost']:.2f})",
        ),
        (
            f"{mean_error(best):.2f}°",
            f"mean tracking error; it was {mean_error(hand):.2f}°",
        ),
        (
            f"{min(held.values()):.0%}",
            "least gain in cost on the three held-out trajectories",
        ),
        (f"{rest:.2f} %", "of range: largest oscillation at rest"),
        (
            str(trials["finished"]),
            f"trials, {trials['pruned']} of them stopped early",
        ),
    ]
    del complete
    boxes = "".join(f"<div><b>{a}</b>{b}</div>" for a, b in cells)
    return (
        f'<div class="figures">{boxes}</div>\n<p class="soft">drake_affetto '
        f"{html.escape(results['version'])}, scenario "
        f"{html.escape(str(results['scenario']))}, seed {results['seed']}, "
        f"best trial {trials['best']}</p>"
    )


def _error_table(results: dict[str, Any]) -> str:
    columns = (TRAINING, *HELD_OUT)
    head = "".join(f"<th>{_label(name)}</th>" for name in columns)
    rows = []
    hand, best = results["hand_tuned"], results["best"]
    for joint in hand["gains"]:
        cells = []
        for name in columns:
            before, after = (
                side["trajectories"][name]["tracking_error_deg"][joint]
                for side in (hand, best)
            )
            cells.append(f"<td>{before:.2f} → {after:.2f}</td>")
        before, after = (
            side["rest_oscillation_percent"][joint] for side in (hand, best)
        )
        cells.append(f"<td>{before:.2f} → {after:.2f}</td>")
        rows.append(f"<tr><td>{_label(joint)}</td>{''.join(cells)}</tr>")
    return (
        f"<table><tr><th>joint</th>{head}<th>at rest [%]</th></tr>"
        f"{''.join(rows)}</table>"
    )


def _gain_table(results: dict[str, Any]) -> str:
    head = "".join(f"<th>{gain}</th>" for gain in GAINS)
    rows = []
    hand, best = results["hand_tuned"]["gains"], results["best"]["gains"]
    for joint, gains in best.items():
        cells = "".join(
            f"<td>{gains[g]:.3g} (× {gains[g] / hand[joint][g]:.2f})</td>"
            for g in GAINS
        )
        rows.append(f"<tr><td>{_label(joint)}</td>{cells}</tr>")
    return f"<table><tr><th>joint</th>{head}</tr>{''.join(rows)}</table>"


def _layout(figure: go.Figure, height: int, **more: Any) -> go.Figure:
    # Plotly's template would set colours of its own, and many bytes.
    figure.update_layout(
        template="none",
        height=height,
        margin={"l": 55, "r": 15, "t": 30, "b": 45},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        **more,
    )
    return figure


def _history(
    trials: Sequence[FrozenTrial], results: dict[str, Any]
) -> go.Figure:
    figure = go.Figure()
    complete = [t for t in trials if t.state == TrialState.COMPLETE]
    pruned = [
        t
        for t in trials
        if t.state == TrialState.PRUNED and t.intermediate_values
    ]
    complete.sort(key=lambda t: t.number)
    values = np.array([t.value for t in complete], dtype=float)
    numbers = [t.number for t in complete]
    figure.add_scatter(
        x=[t.number for t in pruned],
        y=[list(t.intermediate_values.values())[-1] for t in pruned],
        mode="markers",
        name="stopped early",
        marker={"color": _DESIRED, "symbol": "x", "size": 6},
    )
    figure.add_scatter(
        x=numbers,
        y=values.tolist(),
        mode="markers",
        name="trial",
        marker={"color": _AFTER, "size": 5, "opacity": 0.6},
    )
    figure.add_scatter(
        x=numbers,
        y=np.minimum.accumulate(values).tolist() if len(values) else [],
        mode="lines",
        name="best so far",
        line={"color": _AFTER, "width": 2},
    )
    last = max((t.number for t in trials), default=1)
    figure.add_scatter(
        x=[0, last],
        y=[results["hand_tuned"]["cost"]] * 2,
        mode="lines",
        name="hand-tuned",
        line={"color": _BEFORE, "dash": "dash", "width": 2},
    )
    figure.update_xaxes(title_text="trial")
    figure.update_yaxes(title_text="cost", type="log", tickformat="~g")
    return _layout(figure, 420)


def _importance(joints: Sequence[str], share: np.ndarray) -> go.Figure:
    figure = go.Figure()
    colours = ("#0091d5", "#009e73", "#e69f00", "#cc79a7")
    labels = [_label(joint) for joint in reversed(joints)]
    for k, gain in enumerate(GAINS):
        figure.add_bar(
            y=labels,
            x=share[::-1, k].round(4).tolist(),
            name=gain,
            orientation="h",
            marker={"color": colours[k]},
        )
    figure.update_xaxes(
        title_text="share of the joint's cost", tickformat=".0%", range=[0, 1]
    )
    figure.update_yaxes(automargin=True)
    figure.update_layout(legend_traceorder="normal")
    return _layout(figure, 110 + 32 * len(joints), barmode="stack")


def _importance_text(share: np.ndarray | None) -> str:
    if share is None:
        return "<p>Too few trials went all the way to say.</p>"
    return (
        "<p>How much of what a joint's cost differed by over the trials its "
        "own gains explain, each alone or with the others (functional ANOVA "
        "of the logarithm of the cost).</p>"
    )


def _traces(
    names: Sequence[str], evaluation: Evaluation, name: str
) -> go.Figure:
    reference = evaluation.references[name]
    step = max(
        1, round(1.0 / (_TRACE_RATE * (reference.t[1] - reference.t[0])))
    )
    t = reference.t[::step].round(3).tolist()
    figure = make_subplots(
        rows=len(names),
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.25 / max(len(names), 2) / 2,
        subplot_titles=[_label(n) for n in names],
    )
    before, after = evaluation.runs[name]
    for i in range(len(names)):
        for q, label, colour, width in (
            (reference.q, "desired", _DESIRED, 2.5),
            (before.q, "hand-tuned", _BEFORE, 1.3),
            (after.q, "tuned", _AFTER, 1.3),
        ):
            values = np.degrees(q[::step, i]).round(2).tolist()
            figure.add_scatter(
                x=t[: len(values)],
                y=values,
                mode="lines",
                name=label,
                legendgroup=label,
                showlegend=i == 0,
                line={"color": colour, "width": width},
                row=i + 1,
                col=1,
            )
    figure.update_yaxes(title_text="°", title_standoff=2)
    figure.update_xaxes(title_text="s", row=len(names), col=1)
    figure = _layout(figure, 120 + 165 * len(names))
    # The legend stands above the first plot's title.
    figure.update_layout(
        margin={"l": 45, "r": 10, "t": 70, "b": 45},
        legend={"y": 1.0, "yanchor": "bottom", "yref": "paper"},
    )
    figure.update_layout(legend_y=1.0 + 30.0 / (5 + 165 * len(names)))
    return figure
