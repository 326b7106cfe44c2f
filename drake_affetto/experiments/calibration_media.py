"""A 3D replay of a robot that finds the mirror by its own hand."""

from pathlib import Path

import numpy as np

from drake_affetto.calibration.config import load_self_calibration
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.media import Scene, record_replay
from drake_affetto.experiments.mirror_looks import IMAGES, look_from_here
from drake_affetto.experiments.results.self_calibration import REPLAY
from drake_affetto.experiments.self_calibration import (
    Calibrated,
    MirroredSkill,
    Repeat,
)
from drake_affetto.station.scenario import load_scenario

# So many of the looks are shown, one after another.
_LOOKS = 4


def write_calibration_replay(
    out: Path, settings: str, repeat: Repeat, found: Calibrated, seed: int
) -> None:
    """Writes the replay: looks at the hand in the mirror, then a strike.

    Args:
        out: Folder, which exists.
        settings: File of the self-calibration's settings.
        repeat: Repeat that is shown.
        found: What the hand came to there.
        seed: Seed of the noise.
    """
    hand = load_self_calibration(settings).hand
    transform = found.to_direct
    assert transform is not None

    def look(trials: TrialRunner) -> None:
        trials.place_mirror(repeat.mirror)
        trials.settle(np.array(hand.aside), seed)
        for each in found.seen[:_LOOKS]:
            look_from_here(trials, each.readings, hand.blob)
            trials.advance(
                trials.context.get_time()
                + (1.0 - IMAGES[-1]) * trials.scenario.dmp.duration
            )

    def drum(trials: TrialRunner) -> None:
        trials.place_mirror(repeat.mirror)
        skill = MirroredSkill(repeat.skill, transform)
        trials.drum(repeat.positions[0], skill, seed)

    scenario = load_scenario(repeat.scenario)
    record_replay(
        out / REPLAY,
        [Scene("looking", scenario, look), Scene("drumming", scenario, drum)],
    )
