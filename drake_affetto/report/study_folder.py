"""The folders of finished studies, read and checked.

A file of another shape is refused by the name of the file and the place in it,
before anything is drawn.
"""

from collections.abc import Sequence
import dataclasses
import json
from pathlib import Path
import reprlib
from typing import Any

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, require
from drake_affetto.common.typed_json import from_plain
from drake_affetto.experiments.results import STUDY_RESULTS, read_study
from drake_affetto.experiments.results.self_calibration import REPLAY
from drake_affetto.tuning.results import TuningResults

# The kinds of study that the page shows.
STUDIES = (*STUDY_RESULTS, "tune")

# What studies of many bodies are called among the others.
_BODIES = {"mirror": "bodies", "drum": "drum_bodies"}

# What a study's folder can hold beside its numbers, and what kind it is of.
MEDIA = {
    "replay.html": "text/html",
    REPLAY: "text/html",
    "camera_direct.png": "image/png",
    "camera_mirror.png": "image/png",
    "trial.png": "image/png",
    "hit.wav": "audio/wav",
    "miss.wav": "audio/wav",
}
_MAGIC = {"image/png": b"\x89PNG\r\n\x1a\n", "audio/wav": b"RIFF"}


@dataclasses.dataclass(frozen=True)
class StudyFolder:
    """One study's folder.

    Attributes:
        folder: The folder.
        study: Kind of study, one of `STUDIES`, or "bodies" and "drum_bodies"
            for those with a body a repeat, or "self_calibration".
        results: Content of its results.json.
        media: Its pictures, sounds and replay, by file name.
    """

    folder: Path
    study: str
    results: Any
    media: dict[str, Path]


def read_folder(folder: Path) -> StudyFolder:
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
    results = read_json(path)
    study = _study_of(results, path)
    results["study"] = study
    where = f"{path}: "
    if study == "tune":
        found = from_plain(TuningResults, results, where)
        found.check(where)
    else:
        found = read_study(study, results, where)
    version = found.version
    if version.split(".")[:2] != __version__.split(".")[:2]:
        raise InputError(
            f"{path} was made by version {version[:40]}, this is {__version__}:"
            f" run the study again, or `affetto report` of that version"
        )
    # They stand on the page beside the study of one robot.
    if getattr(found, "self_calibration", None):
        study = "self_calibration"
    elif getattr(found, "bodies", None):
        study = _BODIES[study]
    media = {name: folder / name for name in MEDIA if (folder / name).is_file()}
    return StudyFolder(folder, study, found, media)


def read_json(path: Path) -> dict[str, Any]:
    """Reads an object from a JSON file.

    Raises:
        InputError: If it cannot be read or holds anything else.
    """
    try:
        plain = json.loads(path.read_bytes(), parse_constant=_refuse)
    except (ValueError, OSError, RecursionError) as error:
        raise InputError(f"{path} is not readable JSON: {error}") from error
    require(isinstance(plain, dict), str(path), plain, "an object")
    return plain


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
    if not isinstance(study, str) or study not in STUDIES:
        raise InputError(
            f"{path} is of the study {reprlib.repr(study)}, which has no place "
            f"in the report: {', '.join(STUDIES)} have"
        )
    return study


def read_folders(folders: Sequence[Path]) -> dict[str, StudyFolder]:
    """Reads all folders; by study, in the order given.

    Raises:
        InputError: as `read_folder`, if none is given, or if two are of one
            study.
    """
    require(bool(folders), "DIR", list(folders), "at least one folder")
    found: dict[str, StudyFolder] = {}
    for folder in folders:
        source = read_folder(Path(folder).expanduser())
        other = found.setdefault(source.study, source)
        if other is not source:
            raise InputError(
                f"{other.folder} and {source.folder} are both of the study "
                f"{source.study}: give one of them"
            )
    return found


def read_media(path: Path) -> bytes:
    """The bytes of a picture, sound or replay.

    Raises:
        InputError: if it cannot be read or is not what its name says.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    kind = MEDIA[path.name]
    if not data.startswith(_MAGIC.get(kind, b"")) or not data:
        raise InputError(f"{path} is not a file of type {kind}")
    return data
