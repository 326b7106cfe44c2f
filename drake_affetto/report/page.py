"""The page: sections and charts, rendered by templates into one file."""

from collections.abc import Callable, Mapping
import json
from typing import Any

import jinja2
from markupsafe import Markup

from drake_affetto import __version__
from drake_affetto.report import wording
from drake_affetto.report.parts import (
    TEMPLATES,
    Section,
    chart_table,
    picture_of_package,
)
from drake_affetto.report.report_data import ReportData, collect
from drake_affetto.report.sections import (
    bodies,
    conditions,
    drumming,
    faults,
    media,
    origin,
    paper,
    scenarios,
    self_calibration,
    summary,
    toy,
    transfer,
    tuning,
)
from drake_affetto.report.study_folder import StudyFolder
from drake_affetto.report.style import DARK, LIGHT
from drake_affetto.report.wording import conclude

# In the order of the page.
_SECTIONS: tuple[Callable[[ReportData], Section | None], ...] = (
    summary.make,
    media.make,
    drumming.make,
    transfer.make,
    self_calibration.make,
    scenarios.make,
    bodies.make,
    conditions.make,
    faults.make,
    toy.make,
    tuning.make,
    paper.make,
    origin.make,
)


def make_page(folders: Mapping[str, StudyFolder]) -> str:
    """The whole page.

    Args:
        folders: Folders by study, as `read_folders` gives them.

    Raises:
        InputError: If a picture, sound or replay is damaged.
    """
    data = collect(folders)
    sections = [s for make in _SECTIONS if (s := make(data)) is not None]
    charts = [chart for section in sections for chart in section.charts]
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.globals["chart_table"] = chart_table
    bodies = {
        section.key: Markup(
            templates.get_template(f"sections/{section.key}.html.j2").render(
                section.context
            )
        )
        for section in sections
    }
    return templates.get_template("page.html.j2").render(
        version=__version__,
        title=_title(data),
        story=_story(data),
        facts=_facts(data),
        still=_still(data),
        sections=sections,
        bodies=bodies,
        style=_resource("page.css"),
        script=_resource("page.js"),
        walk=_resource("walk.js"),
        plotly=_plotly(),
        figures=_json({chart.key: chart.figure.to_json() for chart in charts}),
        colors=_json({color: DARK[name] for name, color in LIGHT.items()}),
    )


def _resource(name: str) -> Markup:
    return Markup((TEMPLATES / name).read_text(encoding="utf-8"))


def _plotly() -> Markup:
    from plotly.offline import get_plotlyjs

    # Nothing in it may end the script that it stands in.
    return Markup(get_plotlyjs().replace("</script", "<\\/script"))


def _json(value: Any) -> Markup:
    """JSON for a script element, in which nothing can end the element."""
    return Markup(json.dumps(value, allow_nan=False).replace("<", "\\u003c"))


def _facts(data: ReportData) -> list[str]:
    """The line above the title: version, seed, studies."""
    results = [folder.results for folder in data.folders.values()]
    versions = sorted({each.version for each in results})
    seeds = sorted({each.seed for each in results})
    facts = [
        "drake_affetto " + ", ".join(versions),
        f"seed{'' if len(seeds) == 1 else 's'} " + ", ".join(map(str, seeds)),
        wording.joined(list(data.folders)),
    ]
    if data.comparison:
        facts.append(f"scenario {wording.scenario(data.comparison.scenario)}")
    return facts


def _still(data: ReportData) -> Any:
    """The picture of the robot, where a study on the robot is shown."""
    if set(data.folders) == {"toy"}:
        return None
    return picture_of_package(
        "affetto.jpg",
        "The simulated robot: a child's upper body at a wooden table, a "
        "red drum with a green marker before it, and a leaning mirror in "
        "which the drum is seen too",
    )


def _title(data: ReportData) -> str:
    if data.drumming and data.comparison:
        return "Affetto learns to drum, and again through a mirror"
    if data.drumming:
        return "Affetto learns to drum"
    if data.comparison or data.comparisons:
        return "A drumming skill, seen otherwise"
    if data.results("self_calibration"):
        return "Affetto finds the mirror by itself"
    if data.results("bodies") or data.results("drum_bodies"):
        return "Other bodies, the same skill"
    if data.results("tune") and not data.results("toy"):
        return "Gains of the controllers, tuned on the whole robot"
    if data.results("faults") and not data.results("toy"):
        return "A drumming robot when something fails"
    return "Transfer of a skill to inputs it has never seen"


def _story(data: ReportData) -> str:
    """The paragraph that summarizes it all."""
    parts = [
        *_robot_story(data),
        *_drumming_story(data),
        *_mirror_story(data),
        *_self_calibration_story(data),
    ]
    toy = data.results("toy")
    if toy and not parts:
        parts.append(wording.toy_gain(toy) + ".")
    tuned = data.results("tune")
    if tuned and not parts:
        parts.append(wording.tuning_gain(tuned) + ".")
    faults = data.results("faults")
    if faults and not parts:
        parts.append(wording.faults_noticed(faults) + ".")
    if not parts:
        parts.append(
            "How schemes of learning and transfer fare under other conditions."
        )
    return " ".join(parts)


def _robot_story(data: ReportData) -> list[str]:
    if set(data.folders) <= {"toy", "tune", "conditions"}:
        return []
    return [
        "Affetto is a child robot whose joints are moved by air. Here it is "
        "simulated in Drake, from the camera's picture through valves and "
        "pressures to the sound of the drum, and that sound alone judges "
        "every trial."
    ]


def _drumming_story(data: ReportData) -> list[str]:
    drumming = data.drumming
    if drumming is None:
        return []
    where = f"{drumming.per_repeat} places it was never shown"
    if drumming.repeats > 1:
        where += f", in {drumming.repeats} repeats"
    return [
        f"A teacher guides its arm {drumming.demonstrations} times; from "
        "these it learns where to strike when it sees the drum, and hit it "
        f"in {drumming.hits} of "
        f"{wording.number(len(drumming.tests), 'trial')} at {where}."
    ]


def _mirror_story(data: ReportData) -> list[str]:
    comparison = data.comparison
    if comparison is None:
        return []
    n = comparison.samples[-1]
    conclusion = conclude(comparison, n)
    leaders = wording.joined([wording.in_text(k) for k in conclusion.leaders])
    seen = (
        "can only be seen in a mirror"
        if comparison.scenario == "mirror"
        else f"is seen otherwise ({wording.scenario(comparison.scenario)})"
    )
    best = wording.percent(comparison.rates[conclusion.leaders[0]][n].mean)
    text = (
        f"Then the drum {seen}, and {wording.number(n, 'new demonstration')} "
        f"must do: {leaders} did best, with {best}"
    )
    if conclusion.level:
        text += ", not significantly ahead of " + wording.joined(
            [wording.in_text(k) for k in conclusion.level]
        )
    return [text + "."]


def _self_calibration_story(data: ReportData) -> list[str]:
    results = data.results("self_calibration")
    if results is None:
        return []
    methods = results.self_calibration.methods
    ways = wording.joined(
        [
            f"by {wording.METHODS.get(name, name)} "
            f"({wording.percent(method.success_rate.mean)})"
            for name, method in methods.items()
        ]
    )
    return [
        "Where the mirror stands, the robot finds out without a "
        f"demonstration, {ways}."
    ]
