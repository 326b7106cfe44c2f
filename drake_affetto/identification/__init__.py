"""Fits the actuators to the logs of a robot."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.identification.bands import (
        Band,
        BandScale,
        calibrate_bands,
        fit_members,
    )
    from drake_affetto.identification.fit import FitState, fit_logs
    from drake_affetto.identification.prediction import Prediction, predict
    from drake_affetto.identification.problem import FitParameter, JointProblem
    from drake_affetto.identification.simulator import JointSimulator, Simulated
    from drake_affetto.identification.uncertainty import (
        Uncertainty,
        estimate_uncertainty,
        profile_fit,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "Band": "bands",
        "BandScale": "bands",
        "FitParameter": "problem",
        "FitState": "fit",
        "JointProblem": "problem",
        "JointSimulator": "simulator",
        "Prediction": "prediction",
        "Simulated": "simulator",
        "Uncertainty": "uncertainty",
        "calibrate_bands": "bands",
        "estimate_uncertainty": "uncertainty",
        "fit_logs": "fit",
        "fit_members": "bands",
        "predict": "prediction",
        "profile_fit": "uncertainty",
    },
)
