"""The parameterised skill (an ELM) and its transfer to a new view."""

from drake_affetto.skill.adapters import input_jacobian
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import Affine, Domain, Mapping, Similarity
from drake_affetto.skill.schemes import SCHEMES, make_scheme
from drake_affetto.skill.transfer import (
    Start,
    TransferRegressor,
    loo_covariance,
)

__all__ = [
    "SCHEMES",
    "Affine",
    "Domain",
    "ElmRegressor",
    "Mapping",
    "Similarity",
    "Start",
    "TransferRegressor",
    "input_jacobian",
    "loo_covariance",
    "make_scheme",
]
