"""What the page says of the numbers: names, figures in words, conclusions.

Every statement about which scheme is better is computed here from a
`SchemeComparison`; nothing is assumed to come out as in the paper.
"""

from collections.abc import Iterable
import dataclasses

from drake_affetto.experiments.results import SuccessRate, ToyResults
from drake_affetto.report.comparison import Comparison, SchemeComparison
from drake_affetto.tuning.results import TuningResults

# By scheme: what it is called, shortly and in full, and what it does.
SCHEMES: dict[str, tuple[str, str, str]] = {
    "unchanged": (
        "unchanged",
        "Unchanged skill",
        "the skill learned from the direct view, fed with what the new view "
        "shows",
    ),
    "relearn": (
        "relearned",
        "Relearned from scratch",
        "a new skill from the few new demonstrations alone",
    ),
    "continue": (
        "continued",
        "Training continued",
        "the old skill, trained further on the new demonstrations",
    ),
    "transfer": (
        "transfer (paper)",
        "Transfer, the paper's form",
        "the old skill behind an affine map h of its input, fitted to the new "
        "demonstrations (Eq. 5)",
    ),
    "transfer_default": (
        "transfer (ours)",
        "Transfer, our default",
        "the same idea with several starts, whitened residuals and, where the "
        "scenario says so, a map that knows optics",
    ),
    "transfer_affine": (
        "transfer (ours, affine)",
        "Transfer, ours with an affine map",
        "our default, but nothing is known of camera, mirror or table",
    ),
    "gaussian_process": (
        "Gaussian process",
        "Gaussian process",
        "what a practitioner would try first on so few demonstrations",
    ),
    "affine_regression": (
        "linear regression",
        "Linear regression",
        "the movement as an affine function of what the new view shows",
    ),
}

SCENARIOS = {
    "mirror": "mirror",
    "camera_rolled": "camera rolled",
    "camera_replaced": "another camera",
    "head_turned": "head turned",
    "mirror_moved": "mirror moved",
    "mirror_and_camera": "mirror and other camera",
    "wide_angle": "wide-angle lens",
}

TRANSFERS = ("transfer", "transfer_default", "transfer_affine")

# What the paper found in the mirror: each first above each second; unchanged
# and continued do not adapt.
PAPER_ORDER = (
    ("transfer", "relearn"),
    ("transfer", "continue"),
    ("transfer", "unchanged"),
)

# With a space that no line ends at.
_UNIT = "\N{NO-BREAK SPACE}%"

# SuccessRates nearer than this are called equal.
_EQUAL = 0.005

# How the robot finds a mirror by itself.
METHODS = {
    "hand": "its hand in the mirror",
    "ellipse": "the marker's ellipse",
    "ear": "hit or miss by ear",
}


def scheme(name: str, full: bool = False) -> str:
    """What a scheme is called."""
    short, long, _ = SCHEMES.get(name, (name, name, ""))
    return long if full else short


def in_text(name: str) -> str:
    """What it is called within a sentence."""
    return {
        "unchanged": "the unchanged skill",
        "relearn": "relearning from scratch",
        "continue": "continued training",
        "transfer": "transfer in the paper's form",
        "transfer_default": "our default transfer",
        "transfer_affine": "our transfer with an affine map",
        "gaussian_process": "the Gaussian process",
        "affine_regression": "linear regression",
    }.get(name, name)


def scenario(name: str) -> str:
    """What a changed view is called."""
    return SCENARIOS.get(name, name.replace("_", " "))


def ordered(names: Iterable[str]) -> list[str]:
    """Schemes in the paper's order, unknown ones last."""
    places = {name: place for place, name in enumerate(SCHEMES)}
    return sorted(names, key=lambda name: (places.get(name, len(places)), name))


def number(count: int, noun: str) -> str:
    """As "1 trial", "6 trials"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def joined(parts: list[str]) -> str:
    """As "a, b and c"."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"


def percent(share: float) -> str:
    """As "98 %"; what is short of 100 % or above 0 % never looks like it."""
    value = 100.0 * share
    text = f"{value:.0f}"
    if text in ("0", "100") and abs(value - float(text)) > 1e-9:
        text = f"{value:.1f}"
        if text in ("0.0", "100.0"):
            text = "under 0.1" if value < 50 else "over 99.9"
    return f"{text}{_UNIT}"


def rate(value: SuccessRate) -> str:
    """As "98 % (95 to 100)"."""
    return f"{percent(value.mean)} ({interval(value)})"


def interval(value: SuccessRate) -> str:
    """As "95 to 100"."""
    low, high = (
        percent(v).removesuffix(_UNIT) for v in (value.low, value.high)
    )
    return f"{low} to {high}"


def points(difference: float) -> str:
    """As "+12 points"."""
    value = round(100.0 * difference)
    sign = "+" if value > 0 else "−" if value < 0 else "±"
    return f"{sign}{abs(value)} {'point' if abs(value) == 1 else 'points'}"


def p_value(p: float | None) -> str:
    """As "p = 0.03", or that there was no test."""
    if p is None:
        return "not tested"
    text = "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
    if p < 0.05 <= float(f"{p:.2g}"):
        text = "p < 0.05"
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def sentence(text: str) -> str:
    """With a capital and a full stop."""
    return text[0].upper() + text[1:].rstrip(".") + "."


@dataclasses.dataclass(frozen=True)
class Conclusion:
    """How the schemes stand with one number of samples.

    Attributes:
        samples: how many demonstrations.
        leaders: the schemes with the highest mean rate.
        level: others that are not significantly behind any of the leaders,
            where a test was made.
        order: whether the paper's order came out: "clear", "in the means",
            "not", or "" where its schemes were not all run.
        winner: "transfer" where only transfers lead, "equal" where another
            leads together with one or cannot be told apart from it, "other"
            where another is clearly ahead of every transfer or, untested,
            leads alone.
        head: as "With 3 demonstrations".
        text: all of it in plain words, some sentences.
    """

    samples: int
    leaders: list[str]
    level: list[str]
    order: str
    winner: str
    head: str
    text: str


def conclude(comparison: SchemeComparison, samples: int) -> Conclusion:
    """Who wins with `samples` demonstrations, computed and worded."""
    rates = {name: row[samples] for name, row in comparison.rates.items()}
    best = max(r.mean for r in rates.values())
    leaders = [n for n in ordered(rates) if best - rates[n].mean < _EQUAL]
    level = [
        name
        for name in ordered(rates)
        if name not in leaders
        and all(
            (compared := comparison.compare(leader, name, samples)).p
            is not None
            and not compared.clear
            for leader in leaders
        )
    ]
    parts = [_leading(leaders, rates[leaders[0]])]
    if level:
        named = joined(
            [f"{in_text(n)} ({percent(rates[n].mean)})" for n in level]
        )
        parts.append(f"not significantly behind: {named}")
    winner = _winner(leaders, level)
    if set(leaders) - set(TRANSFERS):
        parts.append(_beaten(comparison, samples, rates, leaders))
    order, order_text = _paper_order(comparison, samples, rates)
    parts.append(order_text)
    head = f"With {number(samples, 'demonstration')}"
    text = " ".join(sentence(part) for part in parts if part)
    return Conclusion(samples, leaders, level, order, winner, head, text)


def _leading(leaders: list[str], value: SuccessRate) -> str:
    names = joined([in_text(name) for name in leaders])
    if len(leaders) == 1:
        return f"{names} reached the most, {rate(value)}"
    return f"{names} share the first place with {percent(value.mean)}"


def _winner(leaders: list[str], level: list[str]) -> str:
    here = {name in TRANSFERS for name in leaders}
    if here == {True}:
        return "equal" if set(level) - set(TRANSFERS) else "transfer"
    if True in here or set(level) & set(TRANSFERS):
        return "equal"
    return "other"


def _beaten(
    comparison: SchemeComparison,
    samples: int,
    rates: dict[str, SuccessRate],
    leaders: list[str],
) -> str:
    """How the transfers stand to the best of the others."""
    present = [name for name in TRANSFERS if name in rates]
    others = [name for name in rates if name not in TRANSFERS]
    if not present or not others:
        return ""
    ours = max(present[::-1], key=lambda n: rates[n].mean)
    rival = next(
        (n for n in leaders if n not in TRANSFERS),
        max(ordered(others), key=lambda n: rates[n].mean),
    )
    compared = comparison.compare(rival, ours, samples)
    relation = _relation(compared)
    return (
        f"So {in_text(rival)} was {relation} transfer here "
        f"({percent(rates[rival].mean)} against {percent(rates[ours].mean)}, "
        f"{p_value(compared.p)})"
    )


def _relation(compared: Comparison) -> str:
    """How the first stands to the second, in words before the second."""
    if abs(compared.difference) < _EQUAL:
        return "as good as"
    word = "better" if compared.difference > 0 else "worse"
    if compared.clear:
        return f"clearly {word} than"
    if compared.p is None:
        return f"{word} than"
    return f"{word}, though not significantly, than"


def _paper_order(
    comparison: SchemeComparison, samples: int, rates: dict[str, SuccessRate]
) -> tuple[str, str]:
    if not {name for pair in PAPER_ORDER for name in pair} <= rates.keys():
        return "", ""
    failed, doubtful = [], []
    for a, b in PAPER_ORDER:
        compared = comparison.compare(a, b, samples)
        difference = rates[a].mean - rates[b].mean
        p = p_value(compared.p)
        both = f"{percent(rates[b].mean)} against {percent(rates[a].mean)}"
        if difference <= -_EQUAL:
            relation = _relation(comparison.compare(b, a, samples))
            failed.append(
                f"{in_text(b)} was {relation} {in_text(a)} ({both}, {p})"
            )
        elif difference < _EQUAL:
            failed.append(f"{in_text(b)} was as good as {in_text(a)} ({both})")
        elif not compared.clear:
            doubtful.append(f"{in_text(a)} above {in_text(b)} ({p})")
    if failed:
        return "not", (f"the paper's order did not come out: {joined(failed)}")
    chain = (
        f"transfer in the paper's form {percent(rates['transfer'].mean)}, "
        f"relearning {percent(rates['relearn'].mean)}, continued training "
        f"{percent(rates['continue'].mean)}, unchanged "
        f"{percent(rates['unchanged'].mean)}"
    )
    if doubtful:
        if not comparison.tested:
            return "in the means", (
                f"the paper's order came out in the means ({chain}); so few "
                "trials are no test of it"
            )
        return "in the means", (
            f"the paper's order came out in the means ({chain}), but not "
            f"beyond chance: {joined(doubtful)}"
        )
    return "clear", (
        f"the paper's order came out, each step significant ({chain})"
    )


def toy_gain(toy: ToyResults) -> str:
    """What transfer does on the toy, in one sentence."""
    transfers = toy.transfer
    name = "default" if "default" in transfers else next(iter(transfers))
    ours = transfers[name].other_mse_mean
    turned = toy.source.rotated_mse
    return (
        f"From five points, transfer brings the error on the turned square "
        f"from {turned:.3g} down to {ours:.2g}"
    )


def tuning_gain(results: TuningResults) -> str:
    """What tuning the gains gives, in one sentence."""
    held_out = results.held_out_improvement.values()
    return (
        f"Tuning {number(len(results.joints), 'joint')} in "
        f"{number(results.trials.finished, 'simulation')} changes the cost on "
        f"the training trajectory from {results.hand_tuned.cost:.2f} to "
        f"{results.best.cost:.2f}, and the cost on held-out trajectories by "
        f"{signed_percent(-max(held_out))} to {signed_percent(-min(held_out))}"
    )


def signed_percent(share: float) -> str:
    """As "+12 %", "−5 %", "0 %"."""
    size = round(100.0 * share)
    return f"{'+' if size > 0 else '−' if size < 0 else ''}{abs(size)} %"
