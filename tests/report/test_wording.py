"""Conclusions in words, computed from results."""

import pytest

from drake_affetto.report import wording
from drake_affetto.report.comparison import SchemeComparison
from drake_affetto.report.style import SYMBOLS
from drake_affetto.skill.scheme_names import SCHEMES
from support import report_data
from support.report_page import compare, make, typed


@pytest.mark.parametrize(
    ("winner", "winner_kind", "order", "said"),
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
def test_the_page_says_who_wins(tmp_path, winner, winner_kind, order, said):
    found = wording.conclude(compare(winner), 5)
    assert (found.winner, found.order) == (winner_kind, order)
    made = make(tmp_path, mirror=report_data.mirror(winner))
    assert said in made.text
    for n in (3, 4, 5):
        assert wording.conclude(compare(winner), n).text.replace(
            "\N{NO-BREAK SPACE}", " "
        ) in (made.text)
    shortly = {
        "transfer": "ahead of all other schemes",
        "relearn": "relearning from scratch: 98 %, significantly better",
        "unchanged": "the unchanged skill: 98 %, significantly better",
        "level": "relearning from scratch: 95 %, no significant difference",
    }
    assert shortly[winner] in made.text


def conclude(results):
    schemes = SchemeComparison.of_study(typed(results), "mirror")
    return wording.conclude(schemes, 5)


def test_what_is_not_significant_is_not_called_clear():
    results = report_data.mirror("relearn")
    for row in results["comparisons"]:
        row.update(p=0.2, p_corrected=0.9)
    found = conclude(results)
    assert (found.winner, found.order) == ("equal", "not")
    assert set(found.level) == set(wording.SCHEMES) - {"relearn"}
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
    found = conclude(results)
    assert found.leaders == ["relearn", "transfer_default"]
    assert found.winner == "equal"
    assert "share the first place" in found.text
    assert "relearning from scratch was as good as transfer" in found.text


def test_order_in_the_means_alone_is_not_called_clear():
    results = report_data.mirror("transfer")
    for row in results["comparisons"]:
        if {row["a"], row["b"]} == {"relearn", "transfer"}:
            row.update(p=0.2, p_corrected=0.4)
    found = conclude(results)
    assert found.order == "in the means"
    assert (
        "not beyond chance: transfer in the paper's form above relearning"
        in (found.text)
    )


def test_few_trials_are_no_test():
    demo = typed(report_data.demo()).mirror
    found = wording.conclude(SchemeComparison.of_demo(demo), 5)
    assert found.leaders == ["relearn", "transfer_default"]
    assert found.level == []
    assert "not tested" in found.text
    assert "significant" not in found.text


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
    assert wording.p_value(p).replace("\N{NO-BREAK SPACE}", " ") == said


def test_percent_never_rounds_to_certainty():
    def plain(share):
        return wording.percent(share).replace("\N{NO-BREAK SPACE}", " ")

    assert [plain(s) for s in (0.0, 0.5, 1.0)] == ["0 %", "50 %", "100 %"]
    assert plain(0.996) == "99.6 %"
    assert plain(0.004) == "0.4 %"
    assert plain(0.9999) == "over 99.9 %"
    assert plain(0.0001) == "under 0.1 %"


def test_every_scheme_has_a_label_and_a_color():
    assert tuple(wording.SCHEMES) == SCHEMES
    assert set(SYMBOLS) == set(SCHEMES)
    for name in SCHEMES:
        assert wording.in_text(name) != name
