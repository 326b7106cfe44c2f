"""Results of trials and studies, one dataclass a kind.

The same dataclasses are written to the store and to results.json, and read
from there: `pack` and `unpack` of `trial` for trials, `to_plain` and
`from_plain` of `drake_affetto.common.typed_json` for studies. The order of the
fields is that of the JSON.
"""

from drake_affetto.experiments.results.demo import (
    DemoMirror,
    DemoResults,
    DemoScheme,
    DemoTaught,
    DemoTrial,
)
from drake_affetto.experiments.results.drumming import (
    CurvePoint,
    DrumResults,
    EvaluatedPosition,
    FinalTest,
    LearningCurve,
    RewardEvaluation,
    RewardRow,
    SimilarityTraces,
    TaughtPosition,
)
from drake_affetto.experiments.results.faults import (
    FaultRow,
    FaultsResults,
    SoundTrials,
)
from drake_affetto.experiments.results.mirror import (
    ConditionRow,
    ConditionsResults,
    MirrorResults,
    ScenariosResults,
    SchemeCell,
    SchemeComparisonRow,
    TransferMap,
)
from drake_affetto.experiments.results.rates import SuccessRate
from drake_affetto.experiments.results.study import STUDY_RESULTS, read_study
from drake_affetto.experiments.results.toy import (
    PAPER,
    SourceErrors,
    ToyFigures,
    ToyMethod,
    ToyPaper,
    ToyResults,
    ToySource,
    TransferErrors,
)
from drake_affetto.experiments.results.trial import (
    DemonstrationResult,
    DrummingResult,
    EllipseLookResult,
    GazeResult,
    HandLookResult,
    StrikeResult,
    WatchedResult,
)

__all__ = [
    "PAPER",
    "STUDY_RESULTS",
    "ConditionRow",
    "ConditionsResults",
    "CurvePoint",
    "DemoMirror",
    "DemoResults",
    "DemoScheme",
    "DemoTaught",
    "DemoTrial",
    "DemonstrationResult",
    "DrumResults",
    "DrummingResult",
    "EllipseLookResult",
    "EvaluatedPosition",
    "FaultRow",
    "FaultsResults",
    "FinalTest",
    "GazeResult",
    "HandLookResult",
    "LearningCurve",
    "MirrorResults",
    "RewardEvaluation",
    "RewardRow",
    "ScenariosResults",
    "SchemeCell",
    "SchemeComparisonRow",
    "SimilarityTraces",
    "SoundTrials",
    "SourceErrors",
    "StrikeResult",
    "SuccessRate",
    "TaughtPosition",
    "ToyFigures",
    "ToyMethod",
    "ToyPaper",
    "ToyResults",
    "ToySource",
    "TransferErrors",
    "TransferMap",
    "WatchedResult",
    "read_study",
]
