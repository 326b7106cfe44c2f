"""The parameterized skill (an ELM) and its transfer to a new view."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.skill.adapters import input_jacobian
    from drake_affetto.skill.elm import ElmRegressor
    from drake_affetto.skill.mappings import Affine, Domain, Mapping, Similarity
    from drake_affetto.skill.policy import SkillPolicy, SkillPolicyConfig
    from drake_affetto.skill.residuals import loo_covariance
    from drake_affetto.skill.scheme_names import SCHEMES
    from drake_affetto.skill.schemes import FineTuned, NoTransfer, make_scheme
    from drake_affetto.skill.transfer import Restart, TransferRegressor

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "Affine": "mappings",
        "Domain": "mappings",
        "ElmRegressor": "elm",
        "FineTuned": "schemes",
        "Mapping": "mappings",
        "NoTransfer": "schemes",
        "SCHEMES": "scheme_names",
        "Similarity": "mappings",
        "SkillPolicy": "policy",
        "SkillPolicyConfig": "policy",
        "Restart": "transfer",
        "TransferRegressor": "transfer",
        "input_jacobian": "adapters",
        "loo_covariance": "residuals",
        "make_scheme": "schemes",
    },
)
