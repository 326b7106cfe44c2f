"""Names of the schemes that are compared, in the paper's order.

The names are keys of results.json and of configurations. They stand apart from
`schemes.py`, which imports scikit-learn.
"""

# (i) to (iv) of the paper.
PAPER_SCHEMES = ("unchanged", "relearn", "continue", "transfer")

#: What the studies on the robot compare: the paper's (i) to (iv); (v) transfer
#: with the defaults and whatever map the scenario names; (vi) the same
#: with an affine map, which knows nothing of cameras and mirrors; (vii) a
#: Gaussian process and (viii) a linear regression on the few samples.
SCHEMES = (
    *PAPER_SCHEMES,
    "transfer_default",
    "transfer_affine",
    "gaussian_process",
    "affine_regression",
)
