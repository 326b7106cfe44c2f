"""The parameterized skill (an ELM) and its transfer to a new view."""

from drake_affetto.common.lazy import attach

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "SCHEMES": "scheme_names",
        "Affine": "mappings",
        "Domain": "mappings",
        "ElmRegressor": "elm",
        "Mapping": "mappings",
        "Similarity": "mappings",
        "SkillPolicy": "policy",
        "Start": "transfer",
        "TransferRegressor": "transfer",
        "input_jacobian": "adapters",
        "loo_covariance": "transfer",
        "make_scheme": "schemes",
    },
)
