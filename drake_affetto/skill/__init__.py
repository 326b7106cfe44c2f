"""The parameterised skill (an ELM) and its transfer to a new view."""

from drake_affetto.skill.elm import ElmRegressor

__all__ = ["ElmRegressor"]
