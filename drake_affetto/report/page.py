"""The page itself: sections from what the studies' folders hold."""

import base64
from collections.abc import Callable, Sequence
import dataclasses
import functools
import gzip
import html
import io
import json
from pathlib import Path
import re
import struct
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.report import figures, words
from drake_affetto.report.data import (
    Contest,
    Rate,
    Source,
    read_exhibit,
)
from drake_affetto.report.figures import Chart

_HERE = Path(__file__).parent
_REPLAY_TITLE = "3D replay of a direct and a mirrored trial"


def esc(value: Any) -> str:
    """For text and for attributes in double quotes."""
    return html.escape(str(value), quote=True)


@dataclasses.dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        key: its anchor.
        label: in the navigation.
        title: its heading.
        body: its HTML.
        charts: those whose places stand in `body`.
    """

    key: str
    label: str
    title: str
    body: str
    charts: tuple[Chart, ...] = ()


@dataclasses.dataclass(frozen=True)
class Material:
    """What there is to tell, brought into one form.

    Attributes:
        sources: by study.
        contest: the schemes in the mirror, from the study or the demo.
        contests: by changed view.
        drumming: what `_drumming` makes of the drum study or the demo.
    """

    sources: dict[str, Source]
    contest: Contest | None
    contests: dict[str, Contest]
    drumming: "Drumming | None"

    def results(self, study: str) -> dict[str, Any] | None:
        """The results of a study, if it is there."""
        source = self.sources.get(study)
        return source.results if source else None


@dataclasses.dataclass(frozen=True)
class Drumming:
    """The drum seen directly, from its study or from the demo."""

    demonstrations: int
    taught: list[dict[str, Any]]
    tests: list[dict[str, Any]]
    per_repeat: int
    repeats: int

    @property
    def hits(self) -> int:
        """How many tests were heard as a drum."""
        return sum(row["success"] for row in self.tests)


def gather(sources: dict[str, Source]) -> Material:
    """Brings results of different studies into one form."""
    contests = {}
    if "scenarios" in sources:
        contests = {
            name: Contest.of_study(results, name)
            for name, results in sources["scenarios"]
            .results["scenarios"]
            .items()
        }
    contest = None
    if "mirror" in sources:
        results = sources["mirror"].results
        contest = Contest.of_study(results, results["scenario"])
    elif "mirror" in contests:
        contest = contests["mirror"]
    elif "demo" in sources and sources["demo"].results["mirror"]["schemes"]:
        contest = Contest.of_demo(sources["demo"].results["mirror"])
    return Material(sources, contest, contests, _drumming(sources))


def _drumming(sources: dict[str, Source]) -> Drumming | None:
    if "drum" in sources:
        results = sources["drum"].results
        tests = results["final"]["positions"]
        return Drumming(
            results["demonstrations"],
            results["taught"],
            tests,
            results["evaluations"],
            results["repeats"],
        )
    if "demo" in sources:
        results = sources["demo"].results["drumming"]
        tests = results["positions"]
        return Drumming(
            results["demonstrations"],
            results["taught"],
            tests,
            len(tests),
            1,
        )
    return None


def make_page(sources: dict[str, Source]) -> str:
    """The whole page.

    Args:
        sources: as `read_sources` gives them.

    Raises:
        InputError: if a picture, sound or replay is damaged.
    """
    material = gather(sources)
    packed: dict[str, str] = {}
    makers: list[Callable[[Material], Section | None]] = [
        _short,
        functools.partial(_seen, packed=packed),
        _drum,
        _mirror,
        _scenarios,
        _conditions,
        _toy,
        _paper,
        _origin,
    ]
    sections = [s for make in makers if (s := make(material)) is not None]
    charts = [chart for section in sections for chart in section.charts]
    title = _title(material)
    body = (
        _head(material, title)
        + _navigation(sections)
        + '<main id="main" class="wrap" tabindex="-1">\n<noscript><p>Without '
        "scripts the charts are not drawn; the tables under each hold the same "
        "numbers.</p></noscript>\n"
        + "\n".join(_section_html(section) for section in sections)
        + "\n</main>\n"
        + '<footer><div class="wrap">Made by <code>affetto report</code> of '
        f"drake_affetto {esc(__version__)}. This file needs no network; send "
        "it as it is.</div></footer>"
    )
    data = "\n".join(
        [
            _json_script(
                "figures",
                {chart.key: chart.figure.to_json() for chart in charts},
            ),
            _json_script(
                "colors",
                {
                    color: figures.DARK[name]
                    for name, color in figures.LIGHT.items()
                },
            ),
            *(
                f'<script type="text/plain" id="{key}">{text}</script>'
                for key, text in packed.items()
            ),
        ]
    )
    return _fill(
        (_HERE / "page.html").read_text(encoding="utf-8"),
        {
            "generator": esc(f"drake_affetto {__version__}"),
            "description": esc(_story(material)),
            "title": esc(title),
            "style": (_HERE / "page.css").read_text(encoding="utf-8"),
            "body": body,
            "data": data,
            "plotly": _plotly(),
            "script": (_HERE / "page.js").read_text(encoding="utf-8"),
        },
    )


def _fill(template: str, parts: dict[str, str]) -> str:
    """`template` with its {{names}} replaced, once and all at a time."""
    return re.sub(r"\{\{(\w+)\}\}", lambda m: parts[m.group(1)], template)


def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    # Nothing in it may end the script that it stands in.
    return get_plotlyjs().replace("</script", "<\\/script")


def _json_script(key: str, value: Any) -> str:
    text = json.dumps(value, allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{key}">{text}</script>'


# --- Parts of HTML -----------------------------------------------------------


def _section_html(section: Section) -> str:
    return (
        f'<section id="{section.key}" aria-labelledby="{section.key}-title">\n'
        f'<h2 id="{section.key}-title">{esc(section.title)}</h2>\n'
        f"{section.body}\n</section>"
    )


def _lead(text: str) -> str:
    return f'<p class="lead">{esc(text)}</p>\n'


def _cards(parts: Sequence[str], three: bool = False) -> str:
    kind = "cards three" if three else "cards"
    return f'<div class="{kind}">\n' + "\n".join(parts) + "\n</div>\n"


def _pairs(charts: Sequence[Chart]) -> str:
    """Charts in two columns; one that would stand alone is made wide."""
    placed: list[Chart] = []
    waiting = False
    for chart in charts:
        if waiting and chart.wide:
            placed[-1] = dataclasses.replace(placed[-1], wide=True)
        waiting = not (waiting or chart.wide)
        placed.append(chart)
    if waiting:
        placed[-1] = dataclasses.replace(placed[-1], wide=True)
    return _cards([_chart_html(chart) for chart in placed])


def _chart_html(chart: Chart) -> str:
    wide = " wide" if chart.wide else ""
    table = _table(chart.header, chart.rows, f"Data of: {chart.title}")
    return (
        f'<figure class="card{wide}">\n<h3>{esc(chart.title)}</h3>\n'
        f'<div class="chart empty" style="height:{chart.height}px" role="img" '
        f'data-chart="{esc(chart.key)}" aria-label="'
        f'{esc(f"Chart: {chart.title}. {chart.summary}")}"></div>\n'
        f"<figcaption>{esc(chart.caption)}</figcaption>\n"
        f"<details><summary>The same as a table"
        f'<span class="visually-hidden">: {esc(chart.title)}</span></summary>'
        f"{table}</details>\n</figure>"
    )


def _table(
    header: Sequence[Any],
    rows: Sequence[Sequence[Any]],
    caption: str,
    *,
    best: Callable[[int, int], bool] = lambda row, column: False,
    free: bool = False,
    stacked: bool = False,
    show_caption: bool = False,
) -> str:
    """A table that scrolls by itself; the first cell of a row is its head.

    What follows a line's end in a cell is smaller and below.

    Args:
        header: over the columns.
        rows: of cells.
        caption: what it is; for all to see with `show_caption`.
        best: whether the cell (row, column) is to be marked.
        free: as long as it is, rather than scrolling within a height.
        stacked: on a narrow page the cells of a row stand below each other.
    """
    head = "".join(
        f'<th scope="col" role="columnheader">{esc(cell)}</th>'
        for cell in header
    )
    body = []
    for i, row in enumerate(rows):
        cells = [f'<th scope="row" role="rowheader">{esc(row[0])}</th>']
        for j, cell in enumerate(row[1:], start=1):
            mark = ' class="best"' if best(i, j) else ""
            label = f' data-label="{esc(header[j])}"' if stacked else ""
            value, _, small = str(cell).partition("\n")
            more = f"<small>{esc(small)}</small>" if small else ""
            cells.append(
                f'<td role="cell"{mark}{label}><span>{esc(value)}</span>'
                f"{more}</td>"
            )
        body.append(f'<tr role="row">{"".join(cells)}</tr>')
    kind = "scroll" + " free" * free + " stacked" * stacked
    shown = f'<p class="about">{esc(caption)}</p>' if show_caption else ""
    # The roles are for browsers that forget them where tables are stacked.
    return (
        f'{shown}<div class="{kind}" role="region" tabindex="0" '
        f'aria-label="{esc(caption)}"><table role="table">'
        f'<caption class="visually-hidden">{esc(caption)}</caption>'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">{"".join(body)}</tbody></table></div>'
    )


def _data_uri(data: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"


def _picture(path: Path, alt: str) -> str:
    data = read_exhibit(path)
    width, height = struct.unpack(">II", data[16:24])
    return (
        f'<img src="{_data_uri(data, "image/png")}" width="{width}" '
        f'height="{height}" alt="{esc(alt)}" decoding="async">'
    )


def _still(name: str, alt: str) -> str:
    """A picture that comes with the package, 960 x 640."""
    data = (_HERE / name).read_bytes()
    return (
        f'<img src="{_data_uri(data, "image/jpeg")}" width="960" height="640" '
        f'alt="{esc(alt)}">'
    )


# --- Head --------------------------------------------------------------------


def _title(material: Material) -> str:
    if material.drumming and material.contest:
        return "Affetto learns to drum, and again through a mirror"
    if material.drumming:
        return "Affetto learns to drum"
    if material.contest or material.contests:
        return "A drumming skill, seen otherwise"
    return "Transfer of a skill to inputs it has never seen"


def _story(material: Material) -> str:
    """The paragraph that tells it all."""
    parts = []
    drumming, contest = material.drumming, material.contest
    if drumming or contest or material.contests:
        parts.append(
            "Affetto is a child robot whose joints are moved by air. Here it "
            "is simulated in Drake, from the camera's picture through valves "
            "and pressures to the sound of the drum, and that sound alone "
            "judges every trial."
        )
    if drumming:
        where = (
            f"{drumming.per_repeat} places it was never shown"
            if drumming.repeats == 1
            else f"{drumming.per_repeat} places it was never shown, "
            f"in {drumming.repeats} repeats"
        )
        parts.append(
            f"A person guides its arm {drumming.demonstrations} times; from "
            "these it learns where to strike when it sees the drum, and hit "
            f"it in {drumming.hits} of "
            f"{words.number(len(drumming.tests), 'trial')} at {where}."
        )
    if contest:
        n = contest.samples[-1]
        verdict = words.judge(contest, n)
        leaders = words.joined([words.in_text(k) for k in verdict.leaders])
        seen = (
            "can only be seen in a mirror"
            if contest.scenario == "mirror"
            else f"is seen otherwise ({words.scenario(contest.scenario)})"
        )
        parts.append(
            f"Then the drum {seen}, and {words.number(n, 'new demonstration')} "
            f"must do: {leaders} did best, with "
            f"{words.percent(contest.rates[verdict.leaders[0]][n].mean)}"
            + (
                ", not significantly ahead of "
                + words.joined([words.in_text(k) for k in verdict.level])
                if verdict.level
                else ""
            )
            + "."
        )
    toy = material.results("toy")
    if toy and not parts:
        parts.append(words.toy_gain(toy) + ".")
    if not parts:
        parts.append(
            "How schemes of learning and transfer fare under other conditions."
        )
    return " ".join(parts)


def _head(material: Material, title: str) -> str:
    versions = sorted({s.results["version"] for s in material.sources.values()})
    seeds = sorted({s.results["seed"] for s in material.sources.values()})
    facts = [
        "drake_affetto " + ", ".join(versions),
        f"seed{'' if len(seeds) == 1 else 's'} " + ", ".join(map(str, seeds)),
        words.joined(list(material.sources)),
    ]
    if material.contest:
        facts.append(f"scenario {words.scenario(material.contest.scenario)}")
    robot = set(material.sources) != {"toy"}
    picture = (
        _still(
            "affetto.jpg",
            "The simulated robot: a child's upper body at a wooden table, a "
            "red drum with a green marker before it, and a leaning mirror in "
            "which the drum is seen too",
        )
        if robot
        else ""
    )
    return (
        '<header class="hero"><div class="wrap"><div>\n'
        f'<p class="eyebrow">{esc(" · ".join(facts))}</p>\n'
        f"<h1>{esc(title)}</h1>\n<p>{esc(_story(material))}</p>\n</div>\n"
        f"{picture}\n</div></header>\n"
    )


def _navigation(sections: Sequence[Section]) -> str:
    items = "".join(
        f'<li><a href="#{section.key}">{esc(section.label)}</a></li>'
        for section in sections
    )
    return (
        '<nav aria-label="Sections"><div class="wrap"><ul>'
        f"{items}</ul></div></nav>\n"
    )


# --- Sections ----------------------------------------------------------------


def _short(material: Material) -> Section:
    tiles: list[tuple[str, str, str]] = []
    drumming, contest = material.drumming, material.contest
    if drumming:
        tiles.append(
            (
                f"{drumming.hits} of {len(drumming.tests)}",
                "unseen positions hit, the drum seen directly",
                "after "
                f"{words.number(drumming.demonstrations, 'demonstration')}; "
                "paper: 10 of 10 after 25",
            )
        )
    drum = material.results("drum")
    if drum:
        active = drum.get("active") or {}
        first = drum["n_to_90"]
        if first is not None:
            chosen = active.get("n_to_90")
            tiles.append(
                (
                    str(first),
                    "demonstrations until success stays at 90 %",
                    "given in random order"
                    + (
                        ""
                        if not active
                        else "; never when the skill chooses"
                        if chosen is None
                        else f"; {chosen} when the least certain is next"
                    ),
                )
            )
        separation = drum["separation"]
        wrong = separation["false_hits"] + separation["missed_hits"]
        right = 1.0 - wrong / max(1, separation["trials"])
        tiles.append(
            (
                words.percent(right),
                "of trials judged rightly by sound alone",
                f"{words.number(wrong, 'error')} in {separation['trials']}",
            )
        )
    if contest:
        n = contest.samples[-1]
        verdict = words.judge(contest, n)
        own = [k for k in words.TRANSFERS[::-1] if k in contest.rates]
        if own:
            best = max(own, key=lambda k: contest.rates[k][n].mean)
            tiles.append(
                (
                    words.percent(contest.rates[best][n].mean),
                    f"{words.in_text(best)}, {n} new demonstrations",
                    _standing(contest, verdict),
                )
            )
        if "unchanged" in contest.rates:
            tiles.append(
                (
                    words.percent(contest.rates["unchanged"][n].mean),
                    "the same skill without transfer",
                    f"in the view: {words.scenario(contest.scenario)}",
                )
            )
    toy = material.results("toy")
    if toy:
        name = (
            "default"
            if "default" in toy["transfer"]
            else next(iter(toy["transfer"]))
        )
        tiles.append(
            (
                f"{toy['transfer'][name]['other_mse_mean']:.2g}",
                "toy error after transfer from five points",
                f"{toy['source']['rotated_mse']:.3g} before; paper: "
                f"{toy['paper']['transfer']['other_mse_mean']:g} after",
            )
        )
    if not tiles:
        tiles = _few_tiles(material)
    items = "".join(
        f'<li class="tile"><strong>{esc(value)}</strong> '
        f"<span>{esc(label)}</span>"
        + (f"<small>{esc(note)}</small>" if note else "")
        + "</li>"
        for value, label, note in tiles
    )
    columns = {1: 1, 2: 2, 4: 4, 5: 5, 7: 4, 8: 4}.get(len(tiles), 3)
    body = f'<ul class="tiles" style="--columns:{columns}">{items}</ul>'
    return Section("short", "In short", "In short", body)


def _standing(contest: Contest, verdict: words.Verdict) -> str:
    """How the better of the transfers stands to the others, shortly."""
    rates = {name: row[verdict.samples] for name, row in contest.rates.items()}
    rivals = [
        name
        for name in (*verdict.leaders, *verdict.level)
        if name not in words.TRANSFERS
    ]
    if not rivals:
        return "ahead of all other schemes" + (
            "" if contest.tested else f", {contest.trials} trials each"
        )
    rival = max(rivals, key=lambda name: rates[name].mean)
    told = f"{words.in_text(rival)}: {words.percent(rates[rival].mean)}"
    if not contest.tested:
        return f"{told}; {contest.trials} trials each"
    if verdict.winner == "equal":
        return f"{told}, no significant difference"
    return f"{told}, significantly better"


def _few_tiles(material: Material) -> list[tuple[str, str, str]]:
    tiles = []
    if material.contests:
        tiles.append(
            (str(len(material.contests)), "changed views compared", "")
        )
    conditions = material.results("conditions")
    if conditions:
        places = {
            (row["factor"], row["value"]) for row in conditions["conditions"]
        }
        tiles.append((str(len(places)), "conditions compared", ""))
    return tiles


def _seen(material: Material, packed: dict[str, str]) -> Section | None:
    """Replay, camera, sounds and a trial's curves, all from one folder."""
    source = max(
        material.sources.values(), key=lambda s: len(s.exhibits), default=None
    )
    if source is None or not source.exhibits:
        return None
    found = source.exhibits
    parts = []
    if "replay.html" in found:
        parts.append(_replay(found["replay.html"], packed))
    for name, title, alt, caption in (
        (
            "camera_direct.png",
            "The robot's eye: directly",
            "Camera picture of the drum on the table; a ring marks the green "
            "disc on its head",
            "The drum seen directly. The upper body turns until the marker "
            "found (ring and cross) is centred; the frame is the calibrated "
            "part of the picture.",
        ),
        (
            "camera_mirror.png",
            "The robot's eye: in the mirror",
            "Camera picture of the mirror, in which the drum and the robot's "
            "own arm are seen; a ring marks the green disc on the drum",
            "The drum seen in the mirror, without turning. Left and right, "
            "near and far mean something else here: that is what has to be "
            "transferred.",
        ),
    ):
        if name in found:
            parts.append(
                f'<figure class="card"><h3>{esc(title)}</h3>'
                f"{_picture(found[name], alt)}"
                f"<figcaption>{esc(caption)}</figcaption></figure>"
            )
    sounds = _sounds(found)
    if sounds:
        parts.append(sounds)
    if "trial.png" in found:
        picture = _picture(
            found["trial.png"],
            "Four curves over time of one trial: joint angles beside the "
            "desired ones, chamber pressures, contact force with one stroke, "
            "and the sound with a burst at the stroke",
        )
        parts.append(
            f'<figure class="card wide"><h3>Inside one trial</h3>{picture}'
            "<figcaption>From movement to sound: angles follow the learned "
            "movement with the lag of air, pressures of both chambers of each "
            "joint, the hand's force on the drum, and what the microphone "
            "hears.</figcaption></figure>"
        )
    return Section(
        "seen",
        "See and hear",
        "See it, hear it",
        _lead(
            f"From the {source.study} with seed {source.results['seed']}: "
            "these are the simulated trials themselves, not an animation."
        )
        + _cards(parts),
    )


def _replay(path: Path, packed: dict[str, str]) -> str:
    data = read_exhibit(path)
    packed["replay"] = base64.b64encode(gzip.compress(data, 9, mtime=0)).decode(
        "ascii"
    )
    still = _still("replay.jpg", "")
    return (
        '<figure class="card wide"><h3>The trials in 3D</h3>'
        f'<div class="stage" data-title="{esc(_REPLAY_TITLE)}">{still}'
        f'<button type="button">▶ Show the replay ({len(data) / 1e6:.0f} MB)'
        '</button></div><button type="button" class="again" hidden>Play from '
        "the start</button><figcaption>First the drum seen directly, then the "
        "one seen in the mirror. Drag to turn, scroll to come nearer. It "
        "starts only when you ask for it, and needs WebGL."
        "</figcaption></figure>"
    )


def _sounds(found: dict[str, Path]) -> str:
    items = []
    sounds = {
        name: read_exhibit(found[name])
        for name in ("hit.wav", "miss.wav")
        if name in found
    }
    samples = {name: _samples(data) for name, data in sounds.items()}
    # One scale for both, so that the quiet one looks quiet.
    peak = max(
        (float(np.abs(s).max(initial=0.0)) for s in samples.values()
         if s is not None),
        default=0.0,
    )  # fmt: skip
    for name, title, alt in (
        ("hit.wav", "A hit", "Waveform: silence, then a burst that rings out"),
        ("miss.wav", "A miss", "Waveform of the trial that missed"),
    ):
        if name in sounds:
            data = sounds[name]
            wave = _waveform(samples[name], peak or 1.0, alt)
            items.append(
                f"<div><h4>{esc(title)}</h4>{wave}"
                f'<audio controls preload="metadata" aria-label="'
                f'{esc("Sound of " + title[0].lower() + title[1:])}" '
                f'src="{_data_uri(data, "audio/wav")}"></audio></div>'
            )
    if not items:
        return ""
    return (
        '<figure class="card wide"><h3>What the microphone hears</h3>'
        f'<div class="sounds">{"".join(items)}</div>'
        "<figcaption>The membrane's modes, the shell, the table, the hiss of "
        "the valves and the microphone's noise, synthesised from the "
        "simulated contact. The miss is the same movement with the drum "
        "elsewhere.</figcaption></figure>"
    )


def _samples(data: bytes) -> np.ndarray | None:
    """The sound from -1 to 1; None for a form that is not known."""
    from scipy.io import wavfile

    try:
        _, samples = wavfile.read(io.BytesIO(data))
    except (ValueError, EOFError, struct.error):
        return None
    if samples.dtype != np.int16 or samples.ndim != 1:
        return None
    return samples / 32768.0


def _waveform(
    samples: np.ndarray | None, peak: float, alt: str, columns: int = 300
) -> str:
    """The sound's envelope as a drawing, with `peak` at the full height."""
    if samples is None or len(samples) < columns:
        return ""
    pieces = np.array_split(samples / peak, columns)
    # The root shows what is quiet as well as what is loud.
    high = [34.0 * np.sqrt(max(0.0, piece.max())) for piece in pieces]
    low = [34.0 * np.sqrt(max(0.0, -piece.min())) for piece in pieces]
    upper = " ".join(f"{i},{35 - v:.1f}" for i, v in enumerate(high))
    lower = " ".join(
        f"{i},{35 + v:.1f}" for i, v in reversed(list(enumerate(low)))
    )
    return (
        f'<svg class="wave" viewBox="0 0 {columns - 1} 70" '
        f'preserveAspectRatio="none" role="img" aria-label="{esc(alt)}">'
        f'<polygon points="{upper} {lower}" fill="currentColor" '
        'stroke="currentColor" stroke-width="0.6"/></svg>'
    )


def _drum(material: Material) -> Section | None:
    drumming = material.drumming
    if drumming is None:
        return None
    results = material.results("drum")
    charts = []
    lead = (
        f"{words.number(drumming.demonstrations, 'demonstration')}, given by "
        "hand at places anywhere on the table: the robot turns until the "
        "drum's marker is centred, and from where it then sees the drum and "
        "how far it has turned, the skill makes a movement."
    )
    if results:
        active = results.get("active")
        charts.append(
            figures.learning_curve(
                results["by_demonstrations"],
                active["by_demonstrations"] if active else None,
                evaluations=results["evaluations"],
                repeats=results["repeats"],
            )
        )
    charts.append(figures.workspace(drumming.taught, drumming.tests))
    seen = figures.task_space(drumming.taught, drumming.tests)
    if results:
        similarity = results.get("similarity")
        threshold = results["separation"]["threshold"]
        if similarity:
            charts.append(
                figures.similarity(
                    similarity["t"],
                    similarity["hit"],
                    similarity["miss"],
                    threshold,
                )
            )
        if results["rewards"]:
            charts.append(
                figures.separation(
                    results["rewards"],
                    threshold,
                    results["separation"]["impulse_threshold"],
                )
            )
    if seen is not None and len(charts) % 2:
        charts.insert(1 + len(charts) // 2, seen)
    body = (
        _lead(lead)
        + _verdict_list(
            [("transfer", "What came out", _drum_words(drumming, results))]
        )
        + _pairs(charts)
    )
    return Section(
        "drum",
        "Learning to drum",
        "Learning to drum, the drum seen directly",
        body,
        tuple(charts),
    )


def _drum_words(drumming: Drumming, results: dict[str, Any] | None) -> str:
    parts = [
        f"{drumming.hits} of {len(drumming.tests)} unseen positions were hit "
        f"after {words.number(drumming.demonstrations, 'demonstration')}"
        + (
            f" ({words.number(drumming.repeats, 'repeat')} of "
            f"{drumming.per_repeat} positions)"
            if drumming.repeats > 1
            else ""
        )
    ]
    first = sum(row["attempts"] == 1 for row in drumming.taught)
    if drumming.taught:
        parts.append(
            f"{words.percent(first / len(drumming.taught))} of demonstrations "
            "made a sound at the first try"
        )
    pulls = [
        row["max_pull"]
        for row in drumming.taught
        if row.get("max_pull") is not None
    ]
    if pulls:
        parts.append(
            f"the teacher's hand never pulled with more than {max(pulls):.0f} N"
        )
    if results and results.get("active"):
        random, chosen = results["n_to_90"], results["active"]["n_to_90"]
        if random is None or chosen is None:
            which = {
                (True, True): "neither order",
                (True, False): "only the chosen order",
                (False, True): "only the random order",
            }[random is None, chosen is None]
            parts.append(f"{which} came to stay at 90 % or more")
        elif chosen < random:
            parts.append(
                "giving the next demonstration where the skill is least "
                f"certain brings success to 90 % or more after {chosen} "
                f"rather than {random}"
            )
        else:
            parts.append(
                "giving the next demonstration where the skill is least "
                f"certain did not help: 90 % after {chosen}, in random order "
                f"after {random}"
            )
    elif results and results["n_to_90"] is None:
        parts.append("success did not come to stay at 90 % or more")
    if results:
        separation = results["separation"]
        auc = separation["auc"]
        parts.append(
            f"of {words.number(separation['trials'], 'trial')} the sound took "
            f"{separation['false_hits']} for a hit that was none, and missed "
            f"{words.number(separation['missed_hits'], 'hit')}"
            + ("" if auc is None else f" (area under the curve {auc:.3f})")
        )
    return " ".join(words.sentence(part) for part in parts)


def _verdict_list(items: Sequence[tuple[str, str, str]]) -> str:
    """Boxes of a kind (as `Verdict.winner`), a heading and a text."""
    return (
        '<ul class="verdicts">'
        + "".join(
            f'<li class="{kind}"><b>{esc(head)}</b>{esc(text)}</li>'
            for kind, head, text in items
        )
        + "</ul>\n"
    )


def _mirror(material: Material) -> Section | None:
    contest = material.contest
    if contest is None:
        return None
    main = figures.success_by_scheme(contest)
    rewards = figures.rewards_by_scheme(contest)
    charts = [main] + ([rewards] if rewards else [])
    matrices = (
        [figures.significance(contest, n) for n in contest.samples]
        if contest.tested
        else []
    )
    nets = figures.transfer_map(contest.map) if contest.map else []
    seen = (
        "Now the drum can only be seen in the mirror, and the robot does not "
        "turn: the two numbers that describe where the drum is are others than "
        "those the skill was taught with."
        if contest.scenario == "mirror"
        else "Now the drum is seen otherwise "
        f"({words.scenario(contest.scenario)})."
    )
    lead = (
        f"{seen} A few new demonstrations may be used. The paper found "
        "transfer above relearning and continued training, and these above the "
        "unchanged skill."
    )
    verdicts = [words.judge(contest, n) for n in contest.samples]
    body = [
        _lead(lead),
        _verdict_list([(v.winner, v.head, v.text) for v in verdicts]),
    ]
    if not contest.tested and contest.trials:
        body.append(
            f'<p class="sub">{words.number(contest.trials, "trial")} for each '
            "scheme: one hit more or less makes "
            f"{100 / contest.trials:.0f} points. <code>affetto mirror</code> "
            "repeats it often enough for statistics.</p>"
        )
    body += [_pairs(charts), _key(contest)]
    if matrices:
        body += [
            '<h3 class="sub">Which differences are more than chance?</h3>'
            "<p>Fig. 5b. Every scheme against every other, tested on the "
            "paired repeats and corrected for the number of comparisons.</p>",
            _cards([_chart_html(chart) for chart in matrices], three=True),
        ]
    if contest.map:
        body += [
            '<h3 class="sub">What the transfer has found out</h3><p>'
            + esc(
                f"The map h of {words.in_text(contest.map['scheme'])}, fitted "
                f"to {words.number(contest.map['samples'], 'demonstration')} "
                "(the first repeat's). Solid and dotted lines are the same "
                "lines on both sides, corners A to D the same corners."
            )
            + "</p>",
            _pairs(nets),
        ]
    return Section(
        "mirror",
        "Through the mirror"
        if contest.scenario == "mirror"
        else "Seen otherwise",
        "Through the mirror: which scheme carries over?"
        if contest.scenario == "mirror"
        else "Seen otherwise: which scheme carries over?",
        "\n".join(body),
        (*charts, *matrices, *nets),
    )


def _key(contest: Contest) -> str:
    """What the schemes are, with their colours."""
    dark = {figures.LIGHT[name]: figures.DARK[name] for name in figures.LIGHT}
    items = []
    for name in words.ordered(contest.rates):
        color = figures.scheme_color(name)
        _, _, meaning = words.SCHEMES.get(name, ("", "", ""))
        items.append(
            f'<li><i aria-hidden="true" style="--light:{color};'
            f'--dark:{dark[color]}"></i><div><b>'
            f"{esc(words.scheme(name, full=True))}</b>"
            + (f"<br><span>{esc(meaning)}</span>" if meaning else "")
            + "</div></li>"
        )
    return f'<ul class="key" aria-label="The schemes">{"".join(items)}</ul>\n'


def _scenarios(material: Material) -> Section | None:
    contests = material.contests
    if not contests:
        return None
    chart = figures.scenario_dots(contests)
    counts = sorted({n for c in contests.values() for n in c.samples})
    tables = []
    for n in counts[::-1]:
        header, rows, best = _scenario_rows(contests, n)
        tables.append(
            (
                n,
                _table(
                    header,
                    rows,
                    f"Success with {words.number(n, 'demonstration')}: mean "
                    "and 95 % confidence. A star marks the highest rate.",
                    best=best,
                    free=True,
                    show_caption=True,
                ),
            )
        )
    main, *others = tables
    body = (
        _lead(
            "The same comparison where the camera is rolled or replaced, or "
            "robot or mirror stand elsewhere."
        )
        + _verdict_list([_scenario_words(contests)])
        + _cards([_chart_html(chart)])
        + f'<div class="card wide" style="margin-top:1.25rem">{main[1]}'
        + "".join(
            f"<details><summary>With {words.number(n, 'demonstration')}"
            f"</summary>{table}</details>"
            for n, table in others
        )
        + "</div>"
    )
    return Section(
        "scenarios",
        "Other views",
        "Other changes of the view",
        body,
        (chart,),
    )


def _scenario_rows(
    contests: dict[str, Contest], n: int
) -> tuple[list[str], list[list[str]], Callable[[int, int], bool]]:
    names = words.ordered({k for c in contests.values() for k in c.rates})
    rows, leading = [], []
    for view, contest in contests.items():
        if n not in contest.samples:
            continue
        verdict = words.judge(contest, n)
        rows.append(
            [
                words.scenario(view),
                *(
                    f"{words.percent(contest.rates[name][n].mean)}\n"
                    + words.interval(contest.rates[name][n])
                    if name in contest.rates
                    else "–"
                    for name in names
                ),
                {
                    "transfer": "transfer",
                    "equal": "undecided",
                    "other": words.joined(
                        [words.scheme(k) for k in verdict.leaders]
                    ),
                }[verdict.winner],
            ]
        )
        leading.append({1 + names.index(name) for name in verdict.leaders})
    header = ["view", *(words.scheme(name) for name in names), "ahead"]
    return header, rows, lambda i, j: j in leading[i]


def _scenario_words(contests: dict[str, Contest]) -> tuple[str, str, str]:
    by_winner: dict[str, list[str]] = {"transfer": [], "equal": [], "other": []}
    for view, contest in contests.items():
        verdict = words.judge(contest, contest.samples[-1])
        label = words.scenario(view)
        if verdict.winner == "other":
            names = words.joined([words.in_text(k) for k in verdict.leaders])
            label = f"{label} ({names})"
        by_winner[verdict.winner].append(label)
    parts = []
    for winner, text in (
        ("transfer", "a transfer was ahead of everything else in"),
        (
            "equal",
            "no significant difference between a transfer and another scheme "
            "in",
        ),
        ("other", "another scheme was ahead of both transfers in"),
    ):
        found = by_winner[winner]
        if found:
            parts.append(
                f"{text} {len(found)} of {len(contests)} views: "
                f"{words.joined(found)}"
            )
    return (
        next(
            kind for kind in ("other", "equal", "transfer") if by_winner[kind]
        ),
        "With the most demonstrations of each view",
        " ".join(words.sentence(part) for part in parts),
    )


def _conditions(material: Material) -> Section | None:
    results = material.results("conditions")
    if results is None:
        return None
    rows = results["conditions"]
    heat = [
        chart
        for ours in words.TRANSFERS[::-1]
        if (chart := figures.advantage(rows, ours, "relearn")) is not None
    ]
    charts = figures.condition_charts(rows)
    body = (
        _lead(
            "Where skills are smooth and the workspace small, a few "
            "demonstrations are enough to learn anew, and there is little for "
            "a transfer to win. Here is where it does win and where it does "
            "not."
        )
        + _verdict_list([_condition_words(rows)])
        + _pairs(heat)
        + _pairs(charts)
    )
    return Section(
        "conditions",
        "When it wins",
        "When does transfer win?",
        body,
        (*heat, *charts),
    )


def _condition_words(rows: list[dict[str, Any]]) -> tuple[str, str, str]:
    """How transfers stand to relearning, condition by condition."""
    rates = {
        (r["factor"], r["value"], r["samples"], r["scheme"]): Rate.of(
            r["success_rate"]
        )
        for r in rows
    }
    places = list(
        dict.fromkeys((r["factor"], r["value"], r["samples"]) for r in rows)
    )
    parts = []
    total_ahead = total_behind = 0
    for ours in words.TRANSFERS[::-1]:
        counts = {"ahead": 0, "behind": 0, "between": 0}
        behind = []
        for place in places:
            pair = [rates.get((*place, name)) for name in (ours, "relearn")]
            if pair[0] is None or pair[1] is None:
                continue
            if pair[0].low > pair[1].high:
                counts["ahead"] += 1
            elif pair[0].high < pair[1].low:
                counts["behind"] += 1
                behind.append(f"{place[0]} {place[1]}, {place[2]}")
            else:
                counts["between"] += 1
        total = sum(counts.values())
        if not total:
            continue
        total_ahead += counts["ahead"]
        total_behind += counts["behind"]
        text = (
            f"{words.in_text(ours)} was clearly ahead of relearning in "
            f"{counts['ahead']} of {total} conditions, clearly behind in "
            f"{counts['behind']}, and within their confidence intervals in "
            f"{counts['between']}"
        )
        if behind:
            text += f" (behind: {'; '.join(behind)} demonstrations)"
        parts.append(text)
    if not parts:
        return (
            "equal",
            "What was compared",
            words.sentence(
                f"{len(places)} conditions; relearning or transfer was not run"
            ),
        )
    return (
        "transfer"
        if total_ahead > total_behind
        else "equal"
        if total_ahead == total_behind
        else "other",
        "Clearly means that the confidence intervals do not overlap",
        " ".join(words.sentence(part) for part in parts),
    )


def _toy(material: Material) -> Section | None:
    results = material.results("toy")
    if results is None:
        return None
    from drake_affetto.experiments.toy import BASELINES, TRANSFERS

    labels = {"transfer": TRANSFERS, "baselines": BASELINES}
    paper = results["paper"]["transfer"]["other_mse_mean"]
    charts = [
        figures.toy_errors(
            results, labels, key="toy-unit", square="[0, 1]²", paper=paper
        )
    ]
    if "wide" in results:
        charts.append(
            figures.toy_errors(
                results["wide"],
                labels,
                key="toy-wide",
                square="[−1.3, 1.3]² (harder)",
                paper=None,
            )
        )
    source = results["source"]
    function = results.get("function")
    everything = {
        labels[group].get(name, name): row["other_mse_mean"]
        for group in ("transfer", "baselines")
        for name, row in results[group].items()
        if name != "true_map"
    }
    best = min(everything, key=lambda label: everything[label])
    text = words.toy_gain(results) + (
        f"; the paper's single start reached {paper:g} on its own function. "
        f"Best of all without knowing h: {best}, {everything[best]:.2g}"
    )
    body = (
        _lead(
            "The idea in two dimensions: a network learns a function on a "
            "square, then the square is turned. It is asked where it has "
            "learned nothing "
            f"(error {source['rotated_mse']:.3g} instead of "
            f"{source['test_mse']:.2g}), unless a map h, found from five "
            "points with known values, turns the inputs back."
        )
        + _verdict_list(
            [
                (
                    "other" if best in BASELINES.values() else "transfer",
                    f"{words.number(results['seeds'], 'seed')} with "
                    f"{words.number(results['repeats'], 'choice')} of five "
                    "points each",
                    words.sentence(text),
                )
            ]
        )
        + _cards([_chart_html(chart) for chart in charts])
        + (
            f'<p class="sub">Function: {esc(function)}. Compare the methods '
            "with each other, and with the paper the orders of magnitude.</p>"
            if function
            else ""
        )
    )
    return Section(
        "toy", "Toy", "The idea on a toy problem", body, tuple(charts)
    )


def _paper(material: Material) -> Section | None:
    """Every figure that the paper prints and that was made here too."""
    rows: list[list[str]] = []
    drumming, contest = material.drumming, material.contest
    if drumming:
        rows.append(
            [
                "unseen positions hit, drum seen directly",
                "10 of 10 after 25 demonstrations",
                f"{drumming.hits} of {len(drumming.tests)} after "
                f"{drumming.demonstrations}",
            ]
        )
    drum = material.results("drum")
    if drum:
        separation = drum["separation"]
        rows.append(
            [
                "threshold of the reward",
                "R > 0.15",
                f"R > {separation['threshold']:g}: "
                f"{separation['false_hits']} false and "
                f"{separation['missed_hits']} missed hits in "
                f"{separation['trials']} trials",
            ]
        )
    if contest:
        for n in contest.samples:
            verdict = words.judge(contest, n)
            rates = [
                f"{words.scheme(name)} {words.percent(row[n].mean)}"
                for name, row in sorted(
                    contest.rates.items(), key=lambda item: -item[1][n].mean
                )
            ]
            order = {
                "clear": "the same order, significant",
                "in the means": "the same order in the means only",
                "not": "not the same order",
                "": "not all schemes were run",
            }[verdict.order]
            rows.append(
                [
                    f"order with {words.number(n, 'new demonstration')} "
                    f"({words.scenario(contest.scenario)})",
                    "transfer > continued, relearned > unchanged (3 to 5 "
                    "demonstrations)",
                    f"{order}: {', '.join(rates)}",
                ]
            )
    toy = material.results("toy")
    if toy:
        paper = toy["paper"]
        for key, label in (
            ("train_mse", "toy: error where it was trained"),
            ("test_mse", "toy: error beside that"),
            ("rotated_mse", "toy: error on the turned square"),
        ):
            rows.append(
                [
                    label,
                    f"{paper['source'][key]:.2f}",
                    f"{toy['source'][key]:.2g}"
                    if toy["source"][key] < 1
                    else f"{toy['source'][key]:.2f}",
                ]
            )
        named = {
            "paper_single_start": "Eq. 5, one start",
            "default": "our default",
        }
        for key, label in (
            ("train_mse_mean", "toy: after transfer, the five points"),
            ("other_mse_mean", "toy: after transfer, the other points"),
        ):
            spread = key.replace("mean", "std")
            here = [
                f"{label_}: {toy['transfer'][name][key]:.2g}"
                for name, label_ in named.items()
                if name in toy["transfer"]
            ]
            there = f"{paper['transfer'][key]:.3f}"
            if spread in paper["transfer"]:
                there += f" (± {paper['transfer'][spread]:.3f})"
            rows.append([label, there, ", ".join(here) or "–"])
    if not rows:
        return None
    body = (
        _lead(
            "The paper's figures are of the real robot, these are of a "
            "simulation; the toy's function is a stand-in for the paper's."
            if toy
            else "The paper's figures are of the real robot, these are of a "
            "simulation."
        )
        + '<div class="card wide" style="margin-top:1.25rem">'
        + _table(
            ("", "paper", "here"),
            rows,
            "Beside the paper's numbers",
            free=True,
            stacked=True,
        )
        + "</div>"
    )
    return Section(
        "paper", "Beside the paper", "Beside the paper's numbers", body
    )


_STUDIES = {
    "demo": "the whole story once, at small scale",
    "drum": "success over the number of demonstrations",
    "mirror": "the schemes in one changed view, with statistics",
    "scenarios": "the schemes in all changed views",
    "conditions": "when transfer wins",
    "toy": "the paper's toy experiment",
}


def _origin(material: Material) -> Section:
    rows = []
    for name, source in material.sources.items():
        results = source.results
        size = [
            f"{results[key]} {key}"
            for key in ("repeats", "evaluations", "seeds")
            if isinstance(results.get(key), int)
        ]
        if name == "scenarios":
            size.append(words.number(len(results[name]), "view"))
        rows.append(
            [
                name,
                _STUDIES[name],
                # Not where that is: the page may be sent to others.
                Path(*source.folder.parts[-2:]).as_posix(),
                results["version"],
                results["seed"],
                ", ".join(size) or "–",
            ]
        )
    body = (
        _lead(
            "Schulz, Queisser, Ishihara and Asada, Transfer Learning of "
            "Complex Motor Skills on the Humanoid Robot Affetto (2018), "
            "repeated in simulation. The same version, seed and machine give "
            "the same numbers."
        )
        + '<div class="card wide" style="margin-top:1.25rem">'
        + _table(
            ("study", "what", "folder", "version", "seed", "size"),
            rows,
            "Where the numbers come from",
            free=True,
            stacked=True,
        )
        + "</div>"
    )
    return Section("origin", "Origin", "Where this comes from", body)
