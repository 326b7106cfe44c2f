"""The paper's experiments on the station, one module each."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.experiments.demo import run_demo
    from drake_affetto.experiments.drumming import run_drum
    from drake_affetto.experiments.episode import TrialRunner
    from drake_affetto.experiments.faults import run_faults
    from drake_affetto.experiments.mirror import run_mirror
    from drake_affetto.experiments.plans import (
        DemoPlan,
        DrumPlan,
        FaultsPlan,
        MirrorPlan,
        TeachPlan,
        ToyPlan,
    )
    from drake_affetto.experiments.signals import (
        Signals,
        read_signals,
        run_again,
    )
    from drake_affetto.experiments.tables import read_trials, write_trials
    from drake_affetto.experiments.teaching import teach
    from drake_affetto.experiments.toy import run_toy

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "DemoPlan": "plans",
        "DrumPlan": "plans",
        "FaultsPlan": "plans",
        "MirrorPlan": "plans",
        "Signals": "signals",
        "TeachPlan": "plans",
        "ToyPlan": "plans",
        "TrialRunner": "episode",
        "read_signals": "signals",
        "read_trials": "tables",
        "run_again": "signals",
        "run_demo": "demo",
        "run_drum": "drumming",
        "run_faults": "faults",
        "run_mirror": "mirror",
        "run_toy": "toy",
        "teach": "teaching",
        "write_trials": "tables",
    },
)
