"""The page as a whole: what is on it, and what is not."""

import json
import re

import pytest

from drake_affetto import __version__
from support import report_data
from support.report_page import Page, make

SECTIONS = {
    "short": "In short",
    "seen": "See it, hear it",
    "drum": "Learning to drum",
    "mirror": "Through the mirror",
    "scenarios": "Other changes of the view",
    "conditions": "When does transfer win?",
    "faults": "When something fails",
    "toy": "The idea on a toy problem",
    "paper": "Beside the paper",
    "origin": "Where this comes from",
}


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
        "from scratch) and head turned (the unchanged skill)" in made.text
    )


def test_demo_alone_makes_a_page(demo):
    made = Page(demo)
    assert set(made.sections()) == set(SECTIONS) - {
        "scenarios",
        "conditions",
        "faults",
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


def test_text_is_not_taken_for_a_template(tmp_path):
    results = report_data.toy()
    results["function"] = "{{ version }} {% raw %}"
    assert "{{ version }} {% raw %}" in make(tmp_path, toy=results).text
