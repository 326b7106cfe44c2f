"""The page in a real browser."""

import re

import numpy as np
import pytest

from support import headless_browser


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
