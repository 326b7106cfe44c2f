"""The page: what it says, what it refuses, and that a browser shows it."""

import argparse
from html.parser import HTMLParser
import json
from pathlib import Path
import re

import numpy as np
import pytest

from drake_affetto import __version__, report
from drake_affetto.cli import main as cli
from drake_affetto.cli import report as command
from drake_affetto.common.errors import InputError
from drake_affetto.report import data, figures, page, words
from support import headless_browser, report_data

SECTIONS = {
    "short": "In short",
    "seen": "See it, hear it",
    "drum": "Learning to drum",
    "mirror": "Through the mirror",
    "scenarios": "Other changes of the view",
    "conditions": "When does transfer win?",
    "toy": "The idea on a toy problem",
    "paper": "Beside the paper",
    "origin": "Where this comes from",
}


class Page(HTMLParser):
    """The elements and the texts of a page."""

    VOID = frozenset({"meta", "link", "img", "br", "input", "hr"})

    def __init__(self, path: Path):
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self._inside: list[str] = []
        self.text = ""
        self.html = path.read_text(encoding="utf-8")
        self.feed(self.html)
        self.close()
        assert self._inside == [], "not every element is closed"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self._inside.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self._inside.pop() == tag

    def handle_data(self, data):
        if not {"script", "style"} & set(self._inside):
            self.text += data.replace("\N{NO-BREAK SPACE}", " ")

    def all(self, tag, **attributes):
        return [
            found
            for name, found in self.elements
            if name == tag
            and all(found.get(key) == v for key, v in attributes.items())
        ]

    def sections(self):
        return [found["id"] for found in self.all("section")]


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return report_data.write_all(tmp_path_factory.mktemp("studies"))


@pytest.fixture(scope="module")
def whole(folders, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    return report.write_report(folders, path)


@pytest.fixture(scope="module")
def demo(folders, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "demo.html"
    return report.write_report(folders[:1], path)


def make(tmp_path, **results):
    """A page of the results given by study."""
    given = [
        report_data.write(tmp_path / name, made)
        for name, made in results.items()
    ]
    return Page(report.write_report(given, tmp_path / "page.html"))


# --- What is on the page -----------------------------------------------------


def test_every_study_has_its_section(whole):
    made = Page(whole)
    assert made.sections() == list(SECTIONS)
    for title in SECTIONS.values():
        assert title in made.text
    # Each can be reached from the navigation.
    links = {found["href"] for found in made.all("a")}
    assert links == {"#main"} | {f"#{key}" for key in SECTIONS}
    assert {found.get("id") for _, found in made.elements} >= {
        link[1:] for link in links
    }


@pytest.mark.parametrize(
    ("study", "own", "charts"),
    [
        (
            "drum",
            {"drum", "paper"},
            ["learning-curve", "workspace", "similarity", "separation"],
        ),
        (
            "mirror",
            {"mirror", "paper"},
            [
                "schemes",
                "rewards",
                *(f"significance-{n}" for n in (3, 4, 5)),
                "map-input",
                "map-output",
            ],
        ),
        ("toy", {"toy", "paper"}, ["toy-unit", "toy-wide"]),
        ("conditions", {"conditions"}, None),
    ],
)
def test_what_is_not_there_is_left_out(tmp_path, study, own, charts):
    made = make(tmp_path, **{study: getattr(report_data, study)()})
    assert set(made.sections()) == {"short", "origin"} | own
    if charts is not None:
        drawn = [found["data-chart"] for found in made.all("div", role="img")]
        assert drawn == charts
    assert not made.all("audio")
    assert "replay" not in {found.get("id") for found in made.all("script")}


def test_scenarios_serve_for_the_mirror_too(tmp_path):
    made = make(tmp_path, scenarios=report_data.scenarios())
    assert {"mirror", "scenarios"} <= set(made.sections())
    # Which views a transfer wins is as the data were made.
    assert "ahead of everything else in 2 of 5 views: mirror and another" in (
        made.text
    )
    assert "and another scheme in 1 of 5 views: camera rolled" in made.text
    assert (
        "ahead of both transfers in 2 of 5 views: mirror moved (relearning "
        "from scratch) and robot moved (the unchanged skill)" in made.text
    )


def test_demo_alone_makes_a_page(demo):
    made = Page(demo)
    assert set(made.sections()) == set(SECTIONS) - {
        "scenarios",
        "conditions",
        "toy",
    }
    assert "7 of 8" in made.text
    assert "relearning from scratch: 100 %; 5 trials each" in made.text
    assert "12 demonstrations" in made.text
    assert len(made.all("audio")) == 2
    assert "5 trials for each scheme: one hit more or less makes 20 points" in (
        made.text
    )


def test_the_page_needs_nothing_from_elsewhere(whole):
    made = Page(whole)
    for _, found in made.elements:
        for key in ("src", "href", "srcset", "poster", "action"):
            value = found.get(key)
            assert value is None or value.startswith(("#", "data:")), value
    (policy,) = [
        found["content"]
        for found in made.all("meta")
        if found.get("http-equiv") == "Content-Security-Policy"
    ]
    assert "default-src 'none'" in policy
    assert "http" not in policy
    assert re.search(r"@import|url\((?!['\"]?data:)", made.html) is None or (
        # Plotly's own text may hold such; the page's style may not.
        "url(" not in made.html.split("<style>")[1].split("</style>")[0]
    )


def test_everything_can_be_read_without_seeing(whole):
    made = Page(whole)
    charts = made.all("div", role="img")
    assert len(charts) == len({c["data-chart"] for c in charts}) >= 18
    for chart in charts:
        assert len(chart["aria-label"]) > 40
    # The same as a table below each, and each figure has a caption.
    assert len(made.all("details")) >= len(charts)
    assert len(made.all("figcaption")) == len(made.all("figure")) >= len(charts)
    for picture in made.all("img"):
        assert picture["alt"] is not None
    assert sum(picture["alt"] == "" for picture in made.all("img")) == 1
    for region in made.all("div", role="region"):
        assert region["tabindex"] == "0"
        assert region["aria-label"]
    assert made.all("html", lang="en")
    ids = [found["id"] for _, found in made.elements if "id" in found]
    assert len(ids) == len(set(ids))


def test_who_made_it_is_said(tmp_path):
    made = make(tmp_path, mirror=report_data.mirror(seed=73))
    assert f"drake_affetto {__version__} · seed 73 · mirror" in made.text
    assert "10 repeats, 6 evaluations" in made.text
    # Where the folders are is nobody's business.
    assert str(tmp_path.parent) not in made.html


def test_results_of_figures_are_on_the_page(tmp_path):
    results = report_data.drum(active=True)
    made = make(tmp_path, drum=results)
    hits = sum(row["success"] for row in results["final"]["positions"])
    assert hits == 29
    assert "29 of 30" in made.text
    chosen = results["active"]["n_to_90"]
    assert f"after {chosen} rather than {results['n_to_90']}" in made.text
    assert "missed 0 hits (area under the curve 1.000)" in made.text


def test_active_choice_that_does_not_help_is_said_so(tmp_path):
    results = report_data.drum()
    results["active"]["n_to_90"] = results["n_to_90"] + 2
    made = make(tmp_path, drum=results)
    assert "least certain did not help" in made.text
    results["active"]["n_to_90"] = None
    assert "Only the random order came to stay" in (
        make(tmp_path, drum=results).text
    )
    results["active"] = None
    made = make(tmp_path, drum=results)
    assert "least certain" not in made.text
    results["n_to_90"] = None
    made = make(tmp_path, drum=results)
    assert "Success did not come to stay at 90 %" in made.text


# --- Who wins ----------------------------------------------------------------


def contest(winner, **more):
    results = report_data.mirror(winner, **more)
    return data.Contest.of_study(results, results["scenario"])


@pytest.mark.parametrize(
    ("winner", "verdict", "order", "said"),
    [
        (
            "transfer",
            "transfer",
            "clear",
            "The paper's order came out, each step significant",
        ),
        (
            "relearn",
            "other",
            "not",
            "So relearning from scratch was clearly better than transfer here "
            "(98 % against 60 %, p < 0.001)",
        ),
        (
            "unchanged",
            "other",
            "not",
            "So the unchanged skill was clearly better than transfer here",
        ),
        (
            "level",
            "equal",
            "not",
            "The paper's order did not come out: relearning from scratch was "
            "as good as transfer in the paper's form (95 % against 95 %)",
        ),
    ],
)
def test_the_page_says_who_wins(tmp_path, winner, verdict, order, said):
    found = words.judge(contest(winner), 5)
    assert (found.winner, found.order) == (verdict, order)
    made = make(tmp_path, mirror=report_data.mirror(winner))
    assert said in made.text
    for n in (3, 4, 5):
        assert words.judge(contest(winner), n).text.replace(
            "\N{NO-BREAK SPACE}", " "
        ) in (made.text)
    shortly = {
        "transfer": "ahead of all other schemes",
        "relearn": "relearning from scratch: 98 %, significantly better",
        "unchanged": "the unchanged skill: 98 %, significantly better",
        "level": "relearning from scratch: 95 %, no significant difference",
    }
    assert shortly[winner] in made.text


def test_what_is_not_significant_is_not_called_clear():
    results = report_data.mirror("relearn")
    for row in results["comparisons"]:
        row.update(p=0.2, p_corrected=0.9)
    found = words.judge(data.Contest.of_study(results, "mirror"), 5)
    assert (found.winner, found.order) == ("equal", "not")
    assert set(found.level) == set(words.SCHEMES) - {"relearn"}
    assert "Not significantly behind: the unchanged skill" in found.text
    assert "better, though not significantly, than transfer" in found.text
    assert "clearly" not in found.text


def test_a_shared_first_place_is_shared():
    results = report_data.mirror("level")
    best = results["schemes"]["transfer_default"]
    results["schemes"]["relearn"] = best
    for row in results["comparisons"]:
        if {row["a"], row["b"]} == {"relearn", "transfer_default"}:
            row.update(difference=0.0, p=1.0, p_corrected=1.0)
    found = words.judge(data.Contest.of_study(results, "mirror"), 5)
    assert found.leaders == ["relearn", "transfer_default"]
    assert found.winner == "equal"
    assert "share the first place" in found.text
    assert "relearning from scratch was as good as transfer" in found.text


def test_order_in_the_means_alone_is_not_called_clear():
    results = report_data.mirror("transfer")
    for row in results["comparisons"]:
        if {row["a"], row["b"]} == {"relearn", "transfer"}:
            row.update(p=0.2, p_corrected=0.4)
    found = words.judge(data.Contest.of_study(results, "mirror"), 5)
    assert found.order == "in the means"
    assert (
        "not beyond chance: transfer in the paper's form above relearning"
        in (found.text)
    )


def test_comparisons_are_read_in_both_directions():
    found = contest("transfer")
    there = found.compare("transfer", "unchanged", 3)
    back = found.compare("unchanged", "transfer", 3)
    assert there.difference == -back.difference > 0.0
    assert there.effect_size == -back.effect_size
    assert there.p == back.p
    chart = figures.significance(found, 3)
    z = np.array(chart.figure.data[0].z, dtype=float)
    np.testing.assert_allclose(z + z.T, np.where(np.eye(6), np.nan, 0.0))
    row = words.ordered(found.rates).index("transfer")
    assert z[row, 0] == pytest.approx(100 * there.difference, abs=0.06)


def test_few_trials_are_no_test():
    demo = report_data.demo()["mirror"]
    found = words.judge(data.Contest.of_demo(demo), 5)
    assert found.leaders == ["relearn", "transfer_default"]
    assert found.level == []
    assert "not tested" in found.text
    assert "significant" not in found.text


def test_intervals_of_the_demo_are_wilsons():
    # From the textbook's quadratic: |p - rate| = z sqrt(p (1 - p) / n).
    z = 1.959964
    for hits, n in ((0, 5), (1, 5), (4, 5), (5, 5), (7, 8)):
        found = data.Rate.of_trials(hits / n, n)
        share = hits / n
        roots = np.roots([1 + z**2 / n, -(2 * share + z**2 / n), share**2])
        low, high = np.sort(roots.real)
        assert found.low == pytest.approx(low, abs=1e-7)
        assert found.high == pytest.approx(high, abs=1e-7)
        assert found.low <= found.mean <= found.high


def test_conditions_say_where_transfer_is_behind(tmp_path):
    results = report_data.conditions()
    for row in results["conditions"]:
        if row["value"] == "spread" and row["scheme"] != "relearn":
            row["success_rate"] = {"mean": 0.1, "low": 0.05, "high": 0.15}
    made = make(tmp_path, conditions=results)
    assert "(behind: positions spread, 5 demonstrations)" in made.text
    heat = figures.advantage(
        results["conditions"], "transfer_default", "relearn"
    )
    assert min(v for row in heat.figure.data[0].z for v in row if v) < -20


@pytest.mark.parametrize(
    ("p", "said"),
    [
        (None, "not tested"),
        (1.0, "p = 1"),
        (0.0512, "p = 0.051"),
        (0.0499, "p < 0.05"),
        (0.0312, "p = 0.031"),
        (1e-5, "p < 0.001"),
    ],
)
def test_p_is_never_rounded_across_the_line(p, said):
    assert words.p_value(p).replace("\N{NO-BREAK SPACE}", " ") == said


def test_percent_never_rounds_to_certainty():
    def plain(share):
        return words.percent(share).replace("\N{NO-BREAK SPACE}", " ")

    assert [plain(s) for s in (0.0, 0.5, 1.0)] == ["0 %", "50 %", "100 %"]
    assert plain(0.996) == "99.6 %"
    assert plain(0.004) == "0.4 %"
    assert plain(0.9999) == "over 99.9 %"
    assert plain(0.0001) == "under 0.1 %"


# --- Charts ------------------------------------------------------------------


def luminance(color):
    channels = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in channels
    ]
    return np.array(linear)


def contrast(first, second):
    """As the W3C's guidelines define it."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    a, b = (float(weights @ luminance(c)) + 0.05 for c in (first, second))
    return max(a, b) / min(a, b)


@pytest.mark.parametrize("palette", [figures.LIGHT, figures.DARK])
def test_colours_stand_out_from_the_page(palette):
    for name in ("ink", "muted", "paper"):
        assert contrast(palette[name], palette["surface"]) >= 4.5, name
    for name in (*figures.SYMBOLS, "other_scheme", "hit", "miss", "plus"):
        assert contrast(palette[name], palette["surface"]) >= 3.0, name
    for name in ("pale_plus", "pale_minus"):
        assert contrast(palette[name], palette["ink"]) >= 4.5, name


# Vienot, Brettel and Mollon (1999): linear RGB as red- and green-blind eyes
# have it.
BLIND = {
    "none": np.eye(3),
    "red": np.array(
        [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]
    ),
    "green": np.array(
        [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]
    ),
}


def lab(linear):
    to_xyz = np.array(
        [
            [0.4124, 0.3576, 0.1805],
            [0.2126, 0.7152, 0.0722],
            [0.0193, 0.1192, 0.9505],
        ]
    )
    xyz = to_xyz @ linear / (to_xyz @ np.ones(3))
    x, y, z = np.cbrt(np.maximum(xyz, 0.0))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("palette", [figures.LIGHT, figures.DARK])
@pytest.mark.parametrize("eyes", BLIND)
def test_schemes_differ_for_all_eyes(palette, eyes):
    seen = {
        name: lab(BLIND[eyes] @ luminance(palette[name]))
        for name in figures.SYMBOLS
    }
    names = list(seen)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            distance = np.linalg.norm(seen[a] - seen[b])
            assert distance > 12.0, (a, b, distance)
    assert len(set(figures.SYMBOLS.values())) == len(figures.SYMBOLS)


def test_every_colour_has_one_for_the_dark(whole):
    assert figures.LIGHT.keys() == figures.DARK.keys()
    assert len(set(figures.LIGHT.values())) == len(figures.LIGHT)
    made = whole.read_text(encoding="utf-8")
    text = re.search(r'id="figures">(.*?)</script>', made)[1]
    drawn = json.loads(text)
    assert len(drawn) >= 18
    for key, figure in drawn.items():
        used = set(re.findall(r"#[0-9a-fA-F]{3,8}\b", figure))
        assert used <= set(figures.LIGHT.values()), key
        assert not re.search(r"rgb\(", figure), key


def test_schemes_keep_their_colour():
    found = contest("transfer")
    for chart in (
        figures.success_by_scheme(found),
        figures.rewards_by_scheme(found),
        figures.scenario_dots({"mirror": found}),
        *figures.condition_charts(report_data.conditions()["conditions"]),
    ):
        named = {t.name: t.marker.color for t in chart.figure.data if t.name}
        for name, color in named.items():
            (scheme,) = [k for k in words.SCHEMES if words.scheme(k) == name]
            assert color == figures.LIGHT[scheme], chart.key


def test_separation_counts_every_trial():
    results = report_data.drum()
    rewards = [
        *results["rewards"],
        {"order": "random", "n": 1, "reward": -0.4, "impulse": None},
        {"order": "random", "n": 1, "reward": 1.0, "impulse": 2.0},
    ]
    chart = figures.separation(rewards, 0.15, 0.05)
    counts = np.sum([[row[1], row[2]] for row in chart.rows], axis=0)
    assert counts.sum() == len(rewards)
    hit = sum(r["impulse"] is not None and r["impulse"] > 0.05 for r in rewards)
    assert counts[0] == hit
    # The threshold is an edge: no bar lies on both sides of it.
    for bar in chart.figure.data:
        edges = np.array(bar.x) + 0.025
        assert np.min(np.abs(edges - 0.15)) < 1e-9


def test_tests_are_drawn_where_they_were():
    results = report_data.drum(repeats=1)
    taught, tests = results["taught"], results["final"]["positions"]
    for chart, across, along in (
        (
            figures.workspace(taught, tests),
            lambda row: 100 * row["xy"][1],
            lambda row: 100 * row["xy"][0],
        ),
        (
            figures.task_space(taught, tests),
            lambda row: np.degrees(row["tau"][1]),
            lambda row: row["tau"][0],
        ),
    ):
        np.testing.assert_allclose(
            chart.figure.data[0].x, [across(row) for row in taught]
        )
        hits = [row for row in tests if row["success"]]
        misses = [row for row in tests if not row["success"]]
        for name, rows in (("tested: hit", hits), ("tested: miss", misses)):
            (drawn,) = [
                t
                for t in chart.figure.data
                if t.name == name and t.x[0] is not None
            ]
            np.testing.assert_allclose(drawn.x, [across(r) for r in rows])
            np.testing.assert_allclose(drawn.y, [along(r) for r in rows])
            assert list(drawn.marker.color) == [r["reward"] for r in rows]
        # Left is left: both axes grow towards the robot's left.
        assert chart.figure.layout.xaxis.autorange == "reversed"
        assert len(chart.rows) == len(taught) + len(tests)
    taught[0]["tau"] = [0.1]
    assert figures.task_space(taught, tests) is None


def test_map_keeps_the_grid_together():
    grid = report_data.mirror()["map"]
    before, after = figures.transfer_map(grid)
    lines = [np.array(before.figure.data[k].x, dtype=float) for k in (0, 1)]
    assert [np.isnan(line).sum() for line in lines] == [11, 11]
    # Corner A is the grid's first point, on both sides.
    assert before.figure.data[2].x[0] == grid["input"][0][0]
    assert after.figure.data[2].x[0] == grid["output"][0][0]
    assert after.figure.data[3].y[2] == grid["taught_output"][2][1]


def test_conditions_are_drawn_over_values_and_over_samples():
    charts = figures.condition_charts(report_data.conditions()["conditions"])
    assert [chart.title for chart in charts] == [
        "Teacher",
        "Teacher: as taught",
        "Workspace",
        "Positions",
    ]
    over_samples = charts[1].figure
    assert list(over_samples.layout.xaxis.ticktext) == [
        *("3", "4", "5", "8", "12")
    ]
    # Over the teacher, all values with the same number of samples.
    assert {row[2] for row in charts[0].rows} == {5}


# --- Bad input ---------------------------------------------------------------


NASTY = '<img src="http://evil.example/x.png" onerror="alert(1)">&amp;{{body}}'


def test_nothing_from_a_file_becomes_markup(tmp_path):
    results = report_data.mirror()
    results["scenario"] = NASTY
    results["schemes"][NASTY] = results["schemes"].pop("gaussian_process")
    results["comparisons"][0]["a"] = NASTY
    results["map"]["input_names"] = [NASTY, "</script><script>alert(1)"]
    conditions = report_data.conditions()
    conditions["conditions"][0].update(factor=NASTY, value=NASTY, scheme=NASTY)
    made = make(tmp_path, mirror=results, conditions=conditions)
    assert not [e for e in made.elements if "onerror" in e[1]]
    assert len(made.all("script")) == 4
    assert NASTY in made.text
    drawn = json.loads(
        re.search(r'id="figures">(.*?)</script>', made.html, re.DOTALL)[1]
    )
    # Plotly too reads a kind of HTML.
    for figure in drawn.values():
        assert "<img" not in figure


def change(results, place, value):
    """Sets what stands at a path like `final.positions.0.reward`."""
    *way, last = place.split(".")
    for step in way:
        results = results[int(step) if step.isdigit() else step]
    if value is ...:
        del results[last]
    else:
        results[int(last) if last.isdigit() else last] = value


@pytest.mark.parametrize(
    ("study", "place", "value", "named"),
    [
        ("drum", "by_demonstrations", ..., "by_demonstrations is missing"),
        ("drum", "by_demonstrations", [], "by_demonstrations is empty"),
        (
            "drum",
            "by_demonstrations.3.success_rate.mean",
            1.5,
            "by_demonstrations[3].success_rate.mean is 1.5",
        ),
        ("drum", "final.positions.0.xy", [1.0], "positions[0].xy is [1.0]"),
        ("drum", "final.positions.0.success", 1, "positions[0].success is 1"),
        ("drum", "similarity.hit", [0.1], "similarity has lists"),
        ("drum", "separation.auc", "high", "separation.auc is 'high'"),
        ("drum", "seed", True, "seed is True"),
        ("drum", "version", "9.1.0", "was made by version 9.1.0"),
        ("drum", "version", "0.0.1", "was made by version 0.0.1"),
        ("drum", "study", "identify", "'identify'"),
        ("drum", "study", ["drum"], "['drum']"),
        ("drum", "study", ..., "does not say of which study"),
        ("mirror", "schemes", {}, "schemes is empty"),
        ("mirror", "schemes.relearn.4", ..., "relearn has nothing for 4"),
        ("mirror", "comparisons.0.p_corrected", ..., "p_corrected is missing"),
        ("mirror", "map.shape", [11, 12], "map has 121 inputs"),
        ("mirror", "map.taught_output", [], "taught inputs and outputs"),
        ("mirror", "samples", [], "samples is empty"),
        ("scenarios", "scenarios", {}, "scenarios is empty"),
        (
            "scenarios",
            "scenarios.mirror.schemes.relearn",
            3,
            "scenarios.mirror.schemes.relearn is 3",
        ),
        ("conditions", "conditions.0.samples", 2.5, "samples is 2.5"),
        ("conditions", "conditions", [], "conditions is empty"),
        ("toy", "transfer.default", ..., None),
        ("toy", "transfer", {}, "transfer is empty"),
        ("toy", "wide.source", ..., "wide.source is missing"),
        ("demo", "mirror.schemes.relearn.rewards", None, "rewards is None"),
    ],
)
def test_results_of_another_shape_are_named(
    tmp_path, study, place, value, named
):
    results = getattr(report_data, study)()
    change(results, place, value)
    folder = report_data.write(tmp_path / "study", results)
    if named is None:
        report.write_report([folder], tmp_path / "page.html")
        return
    with pytest.raises(InputError) as error:
        report.write_report([folder], tmp_path / "page.html")
    assert named in str(error.value)
    assert str(folder / "results.json") in str(error.value)
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize(
    "text", ["", "[]", '{"study": "drum"', '{"seed": NaN}', "\xff", "[" * 10**5]
)
def test_files_that_are_no_results(tmp_path, text):
    (tmp_path / "results.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"results\.json"):
        report.write_report([tmp_path], tmp_path / "page.html")


def test_folders_that_do_not_fit(tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"empty has no results\.json"):
        report.write_report([empty], tmp_path / "page.html")
    with pytest.raises(InputError, match="nowhere"):
        report.write_report([tmp_path / "nowhere"], tmp_path / "page.html")
    with pytest.raises(InputError, match="at least one"):
        report.write_report([], tmp_path / "page.html")
    twice = [
        report_data.write(tmp_path / name, report_data.toy())
        for name in ("one", "two")
    ]
    with pytest.raises(InputError, match=r"one.*two.*both of the study toy"):
        report.write_report(twice, tmp_path / "page.html")
    with pytest.raises(InputError, match="a file, not a folder"):
        report.write_report(twice[:1], tmp_path)


@pytest.mark.parametrize("name", ["trial.png", "hit.wav", "replay.html"])
def test_damaged_exhibits_are_named(tmp_path, name):
    folder = report_data.write(tmp_path, report_data.demo(), exhibits=True)
    (folder / name).write_bytes(b"")
    with pytest.raises(InputError, match=name):
        report.write_report([folder], tmp_path / "page.html")


def test_sounds_of_unknown_form_still_play(tmp_path):
    folder = report_data.write(tmp_path, report_data.demo(), exhibits=True)
    (folder / "miss.wav").write_bytes(b"RIFFnothing more")
    made = Page(report.write_report([folder], tmp_path / "page.html"))
    assert len(made.all("audio")) == 2
    assert len(made.all("svg")) == 1


def test_command(tmp_path, capsys):
    folder = report_data.write(tmp_path / "toy", report_data.toy())
    assert cli.main(["report", str(folder)]) == 0
    assert (folder / "report.html").is_file()
    assert str(folder / "report.html") in capsys.readouterr().out
    out = tmp_path / "new" / "page.html"
    assert cli.main(["report", str(folder), "--out", str(out)]) == 0
    # The same results, the same page.
    assert out.read_bytes() == (folder / "report.html").read_bytes()
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "has no results.json" in capsys.readouterr().err
    assert cli.main(["report"]) == 2
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    assert parser.parse_args(["a", "b"]).folders == [Path("a"), Path("b")]


def test_text_in_the_template_is_filled_once():
    assert page._fill("{{a}} {{b}}", {"a": "{{b}}", "b": "x"}) == "{{b}} x"


# --- In a browser ------------------------------------------------------------


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    program = headless_browser.find()
    if program is None:
        pytest.skip("no Chromium or Chrome on this machine")
    profile = tmp_path_factory.mktemp("profile")
    with headless_browser.Browser(program, profile) as found:
        yield found


SIZES = {"laptop": (1280, 800, False), "phone": (390, 844, True)}
DRAWN = "document.documentElement.dataset.theme === '{}'"


def show(browser, path, size="laptop", theme="light"):
    browser.set_size(*SIZES[size])
    browser.set_media(prefers_color_scheme=theme)
    browser.open(path)
    browser.wait_for(DRAWN.format(theme))


@pytest.mark.parametrize("size", SIZES)
def test_browser_shows_everything(browser, whole, size):
    show(browser, whole, size)
    places, counted, drawn = browser.evaluate(
        "[document.querySelectorAll('.chart').length,"
        " Number(document.documentElement.dataset.chartsDrawn),"
        " [...document.querySelectorAll('.chart')].filter(chart =>"
        "   chart.querySelector('.points path, .hm image, .lines path')"
        "   && chart.querySelector('.main-svg').getBoundingClientRect().width"
        "     > 200).length]"
    )
    assert places == counted == drawn >= 18
    # No part is wider than the page; tables scroll by themselves.
    width, inner = browser.evaluate(
        "[document.documentElement.scrollWidth, window.innerWidth]"
    )
    assert width <= inner == SIZES[size][0]
    wide = browser.evaluate(
        "[...document.querySelectorAll('section *')].filter(e =>"
        " !e.closest('.scroll, svg, .stage')"
        " && e.getBoundingClientRect().right > innerWidth + 1)"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert wide == []
    seconds = browser.evaluate(
        "Promise.all([...document.querySelectorAll('audio')].map(a =>"
        " a.readyState ? a.duration : new Promise(done =>"
        " a.addEventListener('loadedmetadata', () => done(a.duration)))))"
    )
    assert seconds == pytest.approx([0.5, 0.5], abs=0.01)
    assert browser.evaluate(
        "[...document.images].every(i => i.complete && i.naturalWidth > 0)"
    )
    assert browser.complaints == []
    assert {url.split(":")[0] for url in browser.requests} <= {"file", "data"}
    assert sum(url.startswith("file:") for url in browser.requests) == 1


def test_browser_follows_the_theme(browser, demo):
    show(browser, demo)
    colors = (
        "[getComputedStyle(document.body).backgroundColor,"
        " getComputedStyle(document.querySelector('.chart .xtick text')).fill]"
    )
    light = browser.evaluate(colors)
    browser.set_media(prefers_color_scheme="dark")
    browser.wait_for(DRAWN.format("dark"))
    dark = browser.evaluate(colors)
    for before, after in zip(light, dark, strict=True):
        a, b = (
            [int(v) for v in re.findall(r"\d+", color)[:3]]
            for color in (before, after)
        )
        assert np.abs(np.subtract(a, b)).min() > 100
    browser.set_media(prefers_color_scheme="light")
    browser.wait_for(DRAWN.format("light"))
    assert browser.evaluate(colors) == light
    assert browser.complaints == []


def test_browser_starts_the_replay_when_asked(browser, demo):
    show(browser, demo)
    assert browser.evaluate("document.querySelector('iframe')") is None
    browser.evaluate(
        "window.said = []; addEventListener('message', e =>"
        " said.push(e.data)); document.querySelector('.stage button').focus()"
    )
    browser.press("Enter", 13)
    browser.wait_for("said.length === 1")
    assert browser.evaluate("said[0]") == "replay runs"
    title, focused, height = browser.evaluate(
        "[document.querySelector('iframe').title,"
        " document.activeElement.tagName,"
        " document.querySelector('iframe').clientHeight]"
    )
    assert "replay" in title
    assert focused == "IFRAME"
    assert height > 300
    browser.evaluate("document.querySelector('.again').click()")
    browser.wait_for("said.length === 2")
    assert browser.complaints == []


def test_browser_can_be_led_by_keyboard(browser, demo):
    show(browser, demo)
    browser.press("Tab", 9)
    assert browser.evaluate("document.activeElement.textContent") == (
        "Skip to the results"
    )
    # It is seen once it has the focus.
    assert browser.evaluate(
        "document.activeElement.getBoundingClientRect().top >= 0"
    )
    browser.press("Enter", 13)
    browser.wait_for("location.hash === '#main'")
    reached = []
    for _ in range(40):
        browser.press("Tab", 9)
        reached.append(
            browser.evaluate(
                "(e => [e.tagName, getComputedStyle(e).outlineStyle])"
                "(document.activeElement)"
            )
        )
        if reached[-1][0] == "BODY":
            break
    kinds = [kind for kind, _ in reached]
    assert {"BUTTON", "AUDIO", "SUMMARY", "DIV"} <= set(kinds)
    assert kinds.count("SUMMARY") == 4
    for kind, outline in reached:
        if kind in ("BUTTON", "SUMMARY", "DIV"):
            assert outline != "none"
