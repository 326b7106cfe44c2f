"""What the page is made from: results of studies, read and checked.

Nothing here draws or words anything. A file of another shape is told by name
and place, before anything is made from it.
"""

from collections.abc import Sequence
import dataclasses
import json
import math
from pathlib import Path
import reprlib
from typing import Any

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, require

# What a study's folder can hold beside its numbers, and what kind it is of.
EXHIBITS = {
    "replay.html": "text/html",
    "camera_direct.png": "image/png",
    "camera_mirror.png": "image/png",
    "trial.png": "image/png",
    "hit.wav": "audio/wav",
    "miss.wav": "audio/wav",
}
_MAGIC = {"image/png": b"\x89PNG\r\n\x1a\n", "audio/wav": b"RIFF"}

# A success of the paper.
THRESHOLD = 0.15


@dataclasses.dataclass(frozen=True)
class Maybe:
    """In a shape: null or `shape`."""

    shape: Any


@dataclasses.dataclass(frozen=True)
class Each:
    """In a shape: an object with any names, whose values have `shape`."""

    shape: Any


@dataclasses.dataclass(frozen=True)
class Row:
    """In a shape: a list of exactly `size` numbers."""

    size: int


@dataclasses.dataclass(frozen=True)
class Share:
    """In a shape: a number from 0 to 1."""


# A shape is float, int, str, bool, one of the above, [shape of the items] or
# {name: shape}, where a name that ends in "?" may be missing.
_RATE = {"mean": Share(), "low": Share(), "high": Share()}
_CURVE = [{"n": int, "success_rate": _RATE}]
_XY = Row(2)
_TAUGHT = {
    "xy": _XY,
    "tau": [float],
    "attempts": int,
    "reward": float,
    "max_pull?": Maybe(float),
}
_CELL = {"success_rate": _RATE, "per_repeat?": [float], "rewards?": [float]}
_MIRROR = {
    "samples": [int],
    "repeats": int,
    "evaluations": int,
    "schemes": Each(Each(_CELL)),
    "comparisons": [
        {
            "a": str,
            "b": str,
            "samples": int,
            "difference": float,
            "p?": Maybe(float),
            "p_corrected": Maybe(float),
            "effect_size?": Maybe(float),
        }
    ],
    "map?": Maybe(
        {
            "scheme": str,
            "samples": int,
            "input_names": [str],
            "output_names": [str],
            "shape": [int],
            "input": [_XY],
            "output": [_XY],
            "taught_input": [_XY],
            "taught_output": [_XY],
        }
    ),
}
_TOY_ROW = {
    "train_mse_mean": float,
    "other_mse_mean": float,
    "other_mse_std": float,
    "other_mse_p95": float,
    "per_seed": Each([float]),
}
_TOY_SOURCE = {"train_mse": float, "test_mse": float, "rotated_mse": float}
_TOY_FIGURES = {
    "source": _TOY_SOURCE,
    "transfer": Each(_TOY_ROW),
    "baselines": Each(_TOY_ROW),
}
SHAPES: dict[str, dict[str, Any]] = {
    "demo": {
        "drumming": {
            "demonstrations": int,
            "taught": [_TAUGHT],
            "positions": [
                {"xy": _XY, "tau": [float], "reward": float, "success": bool}
            ],
            "success_rate": Share(),
        },
        "mirror": {
            "samples": int,
            "taught": [_TAUGHT],
            "positions": [{"xy": _XY}],
            "schemes": Each({"success_rate": Share(), "rewards": [float]}),
        },
    },
    "drum": {
        "demonstrations": int,
        "evaluations": int,
        "repeats": int,
        "taught": [_TAUGHT],
        "first_try?": Maybe(Share()),
        "by_demonstrations": _CURVE,
        "n_to_90": Maybe(int),
        "active?": Maybe({"by_demonstrations": _CURVE, "n_to_90": Maybe(int)}),
        "final": {
            "success_rate": float,
            "positions": [
                {
                    "xy": _XY,
                    "tau": [float],
                    "reward": float,
                    "success": bool,
                    "contact_impulse": Maybe(float),
                }
            ],
        },
        "separation": {
            "auc": Maybe(float),
            "threshold": float,
            "false_hits": int,
            "missed_hits": int,
            "impulse_threshold": float,
            "trials": int,
            "hits": int,
        },
        "rewards": [
            {"order": str, "n": int, "reward": float, "impulse": Maybe(float)}
        ],
        "similarity?": Maybe({"t": [float], "hit": [float], "miss": [float]}),
    },
    "mirror": {"scenario": str, **_MIRROR},
    "scenarios": {"scenarios": Each(_MIRROR)},
    "conditions": {
        "conditions": [
            {
                "factor": str,
                "value": str,
                "scheme": str,
                "samples": int,
                "success_rate": _RATE,
            }
        ]
    },
    "toy": {
        "seeds": int,
        "repeats": int,
        "paper": {
            "source": _TOY_SOURCE,
            "transfer": {
                "train_mse_mean": float,
                "other_mse_mean": float,
                "other_mse_std": float,
            },
        },
        **_TOY_FIGURES,
        "wide?": _TOY_FIGURES,
        "function?": str,
    },
}

_KINDS = {
    float: ((int, float), "a number"),
    int: ((int,), "a whole number"),
    str: ((str,), "a text"),
    bool: ((bool,), "true or false"),
}


def check(value: Any, shape: Any, where: str) -> None:
    """Raises InputError naming the place where `value` is not of `shape`."""

    def need(condition: bool, expected: str) -> None:
        if not condition:
            raise InputError(
                f"{where} is {reprlib.repr(value)}, expected {expected}"
            )

    if isinstance(shape, Maybe):
        if value is not None:
            check(value, shape.shape, where)
    elif isinstance(shape, Share):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        need(number and 0.0 <= value <= 1.0, "a number from 0 to 1")
    elif isinstance(shape, Row):
        check(value, [float], where)
        need(len(value) == shape.size, f"{shape.size} numbers")
    elif isinstance(shape, Each):
        need(isinstance(value, dict), "an object")
        for name, item in value.items():
            check(item, shape.shape, _inside(where, name))
    elif isinstance(shape, list):
        need(isinstance(value, list), "a list")
        for i, item in enumerate(value):
            check(item, shape[0], f"{where}[{i}]")
    elif isinstance(shape, dict):
        need(isinstance(value, dict), "an object")
        for name, part in shape.items():
            key = name.removesuffix("?")
            if key in value:
                check(value[key], part, _inside(where, key))
            elif key == name:
                raise InputError(f"{_inside(where, key)} is missing")
    else:
        types, words = _KINDS[shape]
        fits = isinstance(value, types) and (
            shape is bool or not isinstance(value, bool)
        )
        need(fits, words)


def _inside(where: str, key: str) -> str:
    """The name of the part `key`; `where` may be a file and a colon."""
    return f"{where}{key}" if where.endswith(": ") else f"{where}.{key}"


@dataclasses.dataclass(frozen=True)
class Source:
    """One study's folder.

    Attributes:
        folder: where it is.
        study: a key of `SHAPES`.
        results: its results.json, checked.
        exhibits: its pictures, sounds and replay, by file name.
    """

    folder: Path
    study: str
    results: dict[str, Any]
    exhibits: dict[str, Path]


def read_source(folder: Path) -> Source:
    """Reads the folder of a finished study.

    Raises:
        InputError: if it is none, or of a study or version that has no page,
            or its results.json is damaged or of another shape.
    """
    require(folder.is_dir(), "DIR", str(folder), "the folder of a study")
    path = folder / "results.json"
    if not path.is_file():
        raise InputError(
            f"{folder} has no results.json: not a study's folder, or its study "
            "is not finished"
        )
    try:
        results = json.loads(path.read_bytes(), parse_constant=_refuse)
    except (ValueError, OSError, RecursionError) as error:
        raise InputError(f"{path} is not readable JSON: {error}") from error
    require(isinstance(results, dict), str(path), results, "an object")
    study = _study_of(results, path)
    check(results, {"version": str, "seed": int, **SHAPES[study]}, f"{path}: ")
    version = results["version"]
    if version.split(".")[:2] != __version__.split(".")[:2]:
        raise InputError(
            f"{path} was made by version {version[:40]}, this is {__version__}:"
            f" run the study again, or `affetto report` of that version"
        )
    _check_sizes(results, study, path)
    exhibits = {
        name: folder / name for name in EXHIBITS if (folder / name).is_file()
    }
    return Source(folder, study, results, exhibits)


def _refuse(word: str) -> float:
    raise ValueError(f"it holds {word}")


def _study_of(results: dict[str, Any], path: Path) -> str:
    study = results.get("study")
    if study is None:
        # These two did not always say.
        for name, keys in (
            ("demo", {"drumming", "mirror"}),
            ("toy", {"source", "transfer", "baselines"}),
        ):
            if keys <= results.keys():
                return name
        raise InputError(f"{path} does not say of which study it is")
    if not isinstance(study, str) or study not in SHAPES:
        raise InputError(
            f"{path} is of the study {reprlib.repr(study)}, which has no place "
            f"in the report: {', '.join(SHAPES)} have"
        )
    return study


def _check_sizes(results: dict[str, Any], study: str, path: Path) -> None:
    """That lists which go together are of one length, and none is empty."""

    def need(condition: bool, where: str, message: str) -> None:
        if not condition:
            raise InputError(f"{path}: {where} {message}")

    if study == "drum":
        need(
            bool(results["by_demonstrations"]), "by_demonstrations", "is empty"
        )
        similarity = results.get("similarity")
        if similarity:
            sizes = {len(similarity[key]) for key in ("t", "hit", "miss")}
            need(len(sizes) == 1, "similarity", "has lists of several lengths")
    elif study == "toy":
        for group in ("transfer", "baselines"):
            need(bool(results[group]), group, "is empty")
    elif study == "conditions":
        need(bool(results["conditions"]), "conditions", "is empty")
    elif study == "scenarios":
        need(bool(results["scenarios"]), "scenarios", "is empty")
        for name, each in results["scenarios"].items():
            _check_mirror(each, f"scenarios.{name}.", need)
    elif study == "mirror":
        _check_mirror(results, "", need)


def _check_mirror(results: dict[str, Any], where: str, need: Any) -> None:
    need(bool(results["samples"]), f"{where}samples", "is empty")
    need(bool(results["schemes"]), f"{where}schemes", "is empty")
    for name, cells in results["schemes"].items():
        for samples in results["samples"]:
            need(
                str(samples) in cells,
                f"{where}schemes.{name}",
                f"has nothing for {samples} samples",
            )
    grid = results.get("map")
    if grid:
        sizes = (math.prod(grid["shape"]), len(grid["input"]))
        need(
            len(grid["shape"]) == 2
            and len(grid["output"]) == sizes[0] == sizes[1] > 0,
            f"{where}map",
            f"has {sizes[1]} inputs and {len(grid['output'])} outputs, "
            f"expected a grid of {grid['shape']}",
        )
        for key in ("input_names", "output_names"):
            need(len(grid[key]) == 2, f"{where}map.{key}", "has not two names")
        need(
            len(grid["taught_input"]) == len(grid["taught_output"]),
            f"{where}map",
            "has taught inputs and outputs of several lengths",
        )


@dataclasses.dataclass(frozen=True)
class Rate:
    """A success rate with its confidence interval, each from 0 to 1."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, rate: dict[str, float]) -> "Rate":
        """From the object of a results.json."""
        return cls(rate["mean"], rate["low"], rate["high"])

    @classmethod
    def of_trials(cls, rate: float, trials: int) -> "Rate":
        """Of `trials` single trials: Wilson's interval at 95 %."""
        if trials == 0:
            return cls(rate, 0.0, 1.0)
        z = 1.959964
        centre = (rate + z**2 / (2 * trials)) / (1 + z**2 / trials)
        half = (
            z
            / (1 + z**2 / trials)
            * math.sqrt(rate * (1 - rate) / trials + (z / (2 * trials)) ** 2)
        )
        # Rounding must not put the rate itself outside.
        return cls(
            rate,
            min(rate, max(0.0, centre - half)),
            max(rate, min(1.0, centre + half)),
        )


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Two schemes with the same number of samples.

    Attributes:
        difference: of the mean rates, first minus second.
        p: corrected for the number of comparisons; None if there is no test.
        effect_size: first minus second; None if unknown.
        p_single: before the correction.
    """

    difference: float
    p: float | None = None
    effect_size: float | None = None
    p_single: float | None = None

    @property
    def clear(self) -> bool:
        """Whether the difference is significant."""
        return self.p is not None and self.p < 0.05


@dataclasses.dataclass(frozen=True)
class Contest:
    """The schemes in one changed view, from a study or from the demo.

    Attributes:
        scenario: the view's name.
        samples: numbers of demonstrations.
        trials: for each scheme and number of samples.
        rates: by scheme, by number of samples.
        rewards: of all trials, likewise.
        tested: by (scheme, scheme, samples), where a test was made.
        map: as in results.json, or None.
        error_bars: what `low` and `high` are.
    """

    scenario: str
    samples: tuple[int, ...]
    trials: int
    rates: dict[str, dict[int, Rate]]
    rewards: dict[str, dict[int, list[float]]]
    tested: dict[tuple[str, str, int], Comparison]
    map: dict[str, Any] | None
    error_bars: str

    @classmethod
    def of_study(cls, results: dict[str, Any], scenario: str) -> "Contest":
        """From the results of `affetto mirror`."""
        tested = {}
        for row in results["comparisons"]:
            found = Comparison(
                row["difference"],
                row["p_corrected"],
                row.get("effect_size"),
                row.get("p"),
            )
            effect = found.effect_size
            a, b, samples = row["a"], row["b"], row["samples"]
            tested[a, b, samples] = found
            tested[b, a, samples] = dataclasses.replace(
                found,
                difference=-found.difference,
                effect_size=None if effect is None else -effect,
            )
        cells = {
            name: {n: by_samples[str(n)] for n in results["samples"]}
            for name, by_samples in results["schemes"].items()
        }
        return cls(
            scenario=scenario,
            samples=tuple(sorted(set(results["samples"]))),
            trials=results["repeats"] * results["evaluations"],
            rates={
                name: {
                    n: Rate.of(cell["success_rate"]) for n, cell in row.items()
                }
                for name, row in cells.items()
            },
            rewards={
                name: {n: cell.get("rewards", []) for n, cell in row.items()}
                for name, row in cells.items()
            },
            tested=tested,
            map=results.get("map"),
            error_bars="95 % confidence over the repeats",
        )

    @classmethod
    def of_demo(cls, mirror: dict[str, Any]) -> "Contest":
        """From the part `mirror` of the demo's results."""
        n = mirror["samples"]
        rows = mirror["schemes"]
        trials = len(mirror["positions"])
        return cls(
            scenario="mirror",
            samples=(n,),
            trials=trials,
            rates={
                name: {n: Rate.of_trials(row["success_rate"], trials)}
                for name, row in rows.items()
            },
            rewards={name: {n: row["rewards"]} for name, row in rows.items()},
            tested={},
            map=None,
            error_bars="95 % confidence (Wilson) over the trials",
        )

    def compare(self, a: str, b: str, samples: int) -> Comparison:
        """`a` against `b`; without a test only the difference is known."""
        found = self.tested.get((a, b, samples))
        if found is not None:
            return found
        return Comparison(
            self.rates[a][samples].mean - self.rates[b][samples].mean
        )


def read_sources(folders: Sequence[Path]) -> dict[str, Source]:
    """Reads all folders; by study, in the order given.

    Raises:
        InputError: as `read_source`, if none is given, or if two are of one
            study.
    """
    require(bool(folders), "DIR", list(folders), "at least one folder")
    found: dict[str, Source] = {}
    for folder in folders:
        source = read_source(Path(folder).expanduser())
        other = found.setdefault(source.study, source)
        if other is not source:
            raise InputError(
                f"{other.folder} and {source.folder} are both of the study "
                f"{source.study}: give one of them"
            )
    return found


def read_exhibit(path: Path) -> bytes:
    """The bytes of a picture, sound or replay.

    Raises:
        InputError: if it cannot be read or is not what its name says.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    kind = EXHIBITS[path.name]
    if not data.startswith(_MAGIC.get(kind, b"")) or not data:
        raise InputError(f"{path} is not a file of type {kind}")
    return data
