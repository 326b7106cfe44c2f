"""The page in a real browser."""

import re

import numpy as np
import pytest

from support import accessibility

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


WALK = "document.querySelectorAll('.walk')[{}]"


def spoken_after(browser, *keys):
    for key in keys:
        browser.press(key, 0)
    return browser.evaluate("document.getElementById('spoken').textContent")


def ring_of(browser, chart):
    """Where the mark is in a chart, from 0 to 1; None if it is hidden."""
    return browser.evaluate(
        "(chart => { const ring = chart.querySelector('.ring');"
        " if (ring.hidden) return null;"
        " const b = ring.getBoundingClientRect();"
        " const c = chart.getBoundingClientRect();"
        " return [((b.left + b.right) / 2 - c.left) / c.width,"
        f" ((b.top + b.bottom) / 2 - c.top) / c.height]; }})({chart})"
    )


def test_charts_are_walked_by_the_arrow_keys(browser, whole):
    show(browser, whole)
    chart = WALK.format(0)
    browser.evaluate(f"{chart}.focus()")
    assert ring_of(browser, chart) is None
    first = spoken_after(browser, "ArrowRight")
    start = ring_of(browser, chart)
    second = spoken_after(browser, "ArrowRight")
    assert re.search(r"1 demonstrations: 23 %.*Point 1 of 25", first)
    assert re.search(r"2 demonstrations: 30 %.*Point 2 of 25", second)
    assert ring_of(browser, chart)[0] > start[0]
    # Into another series at the same place, and to its end.
    assert "series 2 of 3" in spoken_after(browser, "ArrowDown")
    assert "Point 25 of 25" in spoken_after(browser, "End")
    assert "Point 25 of 25" in spoken_after(browser, "ArrowRight")
    assert "series 1 of 3" in spoken_after(browser, "ArrowUp")
    assert spoken_after(browser, "Home") == first
    assert ring_of(browser, chart) == pytest.approx(start)
    assert spoken_after(browser, "Escape") == ""
    assert ring_of(browser, chart) is None
    assert browser.complaints == []


def test_every_chart_tells_its_points(browser, whole):
    show(browser, whole)
    count = browser.evaluate("document.querySelectorAll('.walk').length")
    assert count >= 18
    for i in range(count):
        chart = WALK.format(i)
        browser.evaluate(f"{chart}.focus()")
        first, last = (
            spoken_after(browser, "ArrowRight"),
            spoken_after(browser, "End"),
        )
        for said in (first, last):
            assert re.match(r".*\d.*\. Point \d+ of \d+", said), said
            assert len(said.partition(". Point")[0]) > 4
        assert first != last
        # The mark lies on the drawing.
        assert all(0.0 < place < 1.0 for place in ring_of(browser, chart))
    assert browser.complaints == []


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_page_can_be_read_by_all(browser, demo, size, theme):
    show(browser, demo, size, theme)
    assert accessibility.serious_faults(browser) == []
