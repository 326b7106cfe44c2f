"""Names of the schemes that are compared, in the paper's order.

The names are keys of results.json and of configurations. They stand apart from
`schemes.py`, which imports scikit-learn.
"""

# (i) to (iv) of the paper.
PAPER_SCHEMES = ("unchanged", "relearn", "continue", "transfer")

# (v) transfer with the library's defaults, (vi) a Gaussian process on the few
# samples: what the studies on the robot compare.
STUDY_SCHEMES = (*PAPER_SCHEMES, "transfer_default", "gaussian_process")

SCHEMES = (*STUDY_SCHEMES, "affine_regression")
