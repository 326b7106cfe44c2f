"""A page of the report, taken apart."""

from html.parser import HTMLParser
import json
from pathlib import Path

from drake_affetto import report
from drake_affetto.experiments.results import read_study
from drake_affetto.report.comparison import SchemeComparison
from support import report_data


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


def make(tmp_path, **results):
    """A page of the results given by study."""
    given = [
        report_data.write(tmp_path / name, made)
        for name, made in results.items()
    ]
    return Page(report.write_report(given, tmp_path / "page.html"))


def typed(results):
    """Results of a study as the dataclass that the page uses."""
    study = results["study"]
    return read_study(study, json.loads(json.dumps(results)), "made up: ")


def compare(winner, **more):
    """The schemes of a made-up mirror study."""
    results = typed(report_data.mirror(winner, **more))
    return SchemeComparison.of_study(results, results.scenario)
