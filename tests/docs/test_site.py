"""The site, built small and opened in a real browser.

All pages are built; of the tutorials two short ones are run. Those that take
longer are run by `make docs`, and as scripts by tests/analysis.
"""

from html.parser import HTMLParser
import json
from pathlib import Path
import re
from urllib.parse import unquote, urlsplit

import nbclient
import nbformat
import pytest

from support import accessibility, site

pytestmark = pytest.mark.slow

RUN = "parts/dmp_source.py,pneumatic_arm.py"
# Judged by axe. Long pages of the same kind take it minutes.
MAIN = (
    "index.html",
    "start.html",
    "howto/drum.html",
    "physics/pneumatics.html",
    "tutorials/pneumatic_arm.html",
    "api/rooms/motion.html",
    "protocol.html",
)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return site.copy_sources(tmp_path_factory.mktemp("site") / "tree")


@pytest.fixture(scope="module")
def built(tree):
    done = site.build(tree, RUN)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return tree / "out/docs"


class Links(HTMLParser):
    """What a page refers to, and what can be referred to in it."""

    def __init__(self, path: Path):
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.ids: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        if "id" in found:
            self.ids.add(found["id"])
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if found.get("src"):
            self.loads.append(found["src"])
        if tag == "link" and found.get("rel") in ("stylesheet", "icon"):
            self.loads.append(found["href"])


def test_nothing_is_loaded_from_elsewhere_and_no_link_is_dead(built):
    pages = {path.resolve(): Links(path) for path in built.rglob("*.html")}
    assert len(pages) > 60
    dead = []
    for path, page in pages.items():
        for link in page.loads:
            where = urlsplit(link)
            assert where.scheme in ("", "data"), f"{path.name}: {link}"
            if not where.scheme:
                target = (path.parent / unquote(where.path)).resolve()
                assert target.is_file(), f"{path.name}: {link}"
        for link in page.links:
            where = urlsplit(link)
            if where.scheme:
                continue
            target = path
            if where.path:
                target = (path.parent / unquote(where.path)).resolve()
            anchor = unquote(where.fragment)
            if not target.is_file() or (
                anchor and target in pages and anchor not in pages[target].ids
            ):
                dead.append(f"{path.relative_to(built.resolve())}: {link}")
    assert dead == []
    for path in built.rglob("*.css"):
        addresses = re.findall(r"url\(['\"]?(\w+):", path.read_text())
        assert set(addresses) <= {"data"}, path.name
        assert "@import" not in path.read_text()


def test_every_page_opens_without_complaint_and_fits_a_phone(browser, built):
    browser.set_size(360, 780, True)
    for path in sorted(built.rglob("*.html")):
        browser.open(path)
        width, inner = browser.evaluate(
            "[document.documentElement.scrollWidth, innerWidth]"
        )
        assert width <= inner == 360, path.name
        assert browser.complaints == [], path.name
        elsewhere = {url.split(":")[0] for url in browser.requests}
        assert elsewhere <= {"file", "data"}


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 360)])
def test_main_pages_can_be_read_by_all(browser, built, theme, width):
    browser.set_media(prefers_color_scheme=theme)
    browser.set_size(width, 800, width < 500)
    for name in MAIN:
        browser.open(built / name)
        assert accessibility.serious_faults(browser) == [], name


def test_blocks_stand_left_to_right_and_stack_on_a_phone(browser, built):
    places = (
        "[...document.querySelector('.system-block').children]"
        ".map(e => { const b = e.getBoundingClientRect();"
        " return [b.left, b.top]; })"
    )
    browser.set_size(1280, 800)
    browser.open(built / "api/rooms/perception.html")
    left = [x for x, _ in browser.evaluate(places)]
    assert left == sorted(left)
    assert left[0] < left[1] < left[2]
    browser.set_size(360, 780, True)
    browser.open(built / "api/rooms/perception.html")
    top = [y for _, y in browser.evaluate(places)]
    assert top[0] < top[1] < top[2]


def test_formulas_are_drawn(browser, built):
    browser.set_size(1280, 800)
    browser.open(built / "physics/sound.html")
    heights = browser.evaluate(
        "[...document.querySelectorAll('.formula math')]"
        ".map(e => e.getBoundingClientRect().height)"
    )
    assert len(heights) >= 5
    assert min(heights) > 20


def test_what_a_tutorial_prints_is_shown(built):
    text = (built / "tutorials/pneumatic_arm.html").read_text()
    assert "sphx-glr-script-out" in text
    # Not run here, and shown all the same.
    assert (built / "tutorials/own_parts.html").is_file()


def test_a_notebook_runs_in_a_plain_jupyter(built, tree, tmp_path):
    path = tree / "docs/tutorials/pneumatic_gripper.ipynb"
    for beside in path.parent.glob("*.yaml"):
        (tmp_path / beside.name).write_text(beside.read_text())
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(
        notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    outputs = [
        output
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if output.get("name") == "stdout"
    ]
    assert outputs, json.dumps(notebook.cells[-1], default=str)[:500]


def test_a_tutorial_that_fails_stops_the_build_and_is_named(tmp_path):
    tree = site.copy_sources(tmp_path / "tree")
    bad = tree / "analysis/tutorials/trips.py"
    bad.write_text('"""Tutorial: trip."""\n\nraise RuntimeError("over it")\n')
    done = site.build(tree, "trips.py")
    assert done.returncode != 0
    said = done.stdout + done.stderr
    assert "trips.py unexpectedly failed" in said
    assert "RuntimeError: over it" in said
    assert not (tree / "out/docs/index.html").exists()
