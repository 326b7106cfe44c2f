"""How the toy experiment's free choices were made, on seeds of no report.

    python analysis/experiments/toy_choices.py [--seeds 12] [--repeats 40]
        [--first-seed 1000] [--only source|squares|starts|prior ...]

Prints, as medians over the seeds of means over the choices of five points
(also means over the seeds, where the paper's single draw may be either):

- source: errors before transfer, by spread of the ELM's weights;
- squares: the same and the errors after transfer on several squares;
- starts: errors of Eq. 5 by λ and number of random starts, best by cost;
- prior: errors of the default by weights of its prior.
"""

import argparse
import itertools
from unittest import mock
import warnings

import numpy as np

from drake_affetto.experiments import toy
from drake_affetto.skill import transfer

SQUARES = {
    "[0, 1]²": toy.DOMAINS["unit"],
    "[-1, 1]²": toy.ToyDomain(-1.0, 1.0),
    "[-1.3, 1.3]²": toy.DOMAINS["wide"],
    "[0, 2]²": toy.ToyDomain(0.0, 2.0),
    "[1, 2]²": toy.ToyDomain(1.0, 2.0),
}
WEIGHT_SCALES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
LAMBDAS = (1e-4, 1e-3, 1e-2, 3e-2)
STARTS = (1, 2, 3, 5, 10)
PAPER_SOURCE = "paper                0.00     0.06    41.71"


def mse(estimator, X, y):
    """Mean squared error."""
    return np.mean((estimator.predict(X) - y) ** 2)


def source_errors(problem):
    """Errors on the 14, the 6, and the 20 turned points."""
    return [
        mse(problem.source, X, y)
        for X, y in (
            (problem.X, problem.y),
            (problem.X_test, problem.y_test),
            (problem.X_target, problem.y_target),
        )
    ]


def show(label, rows):
    """Medians and means of rows (seeds, columns)."""
    for kind, statistic in (("median", np.median), ("mean", np.mean)):
        values = "  ".join(f"{v:7.4f}" for v in statistic(rows, axis=0))
        print(f"{label:28s} {kind:6s} {values}", flush=True)


def choose_source(seeds, repeats):
    """Errors before transfer; cheap, so from 400 draws."""
    print(f"\nsource: train, test, turned; {PAPER_SOURCE}")
    draws = range(seeds[0], seeds[0] + 400)
    for scale in WEIGHT_SCALES:
        problems = (
            toy.make_problem(toy.DOMAINS["unit"], seed, scale) for seed in draws
        )
        show(f"weight_scale {scale:g}", [source_errors(p) for p in problems])


def other_errors(name, problem, seed, repeats):
    """Mean error of a method on the points not given."""
    errors = []
    for repeat in range(repeats):
        known = toy.subset(seed, repeat)
        predicted = toy.predict_target(name, problem, known, repeat)
        errors.append(np.mean((predicted - problem.y_target)[~known] ** 2))
    return np.mean(errors)


def choose_square(seeds, repeats):
    """Errors before and after transfer on several squares."""
    names = ("paper", "default", "unlabelled", "true_map", "affine_regression")
    print(f"\nsquares: train, test, turned, then {', '.join(names)}")
    for label, domain in SQUARES.items():
        rows = []
        for seed in seeds:
            problem = toy.make_problem(domain, seed)
            rows.append(
                source_errors(problem)
                + [other_errors(n, problem, seed, repeats) for n in names]
            )
        show(label, rows)


def choose_starts(seeds, repeats):
    """Errors of Eq. 5: mean and deviation on the five, and on the others."""
    print("\nstarts: five, ±, others, ±; paper 0.001 0.001 0.354 0.661")
    for alpha in LAMBDAS:
        rows = {count: [] for count in STARTS}
        for seed in seeds:
            problem = toy.make_problem(toy.DOMAINS["unit"], seed)
            errors = np.array(
                [start_errors(problem, seed, r, alpha) for r in range(repeats)]
            )
            for i, count in enumerate(STARTS):
                mean, std = errors[:, i].mean(0), errors[:, i].std(0)
                rows[count].append([mean[0], std[0], mean[1], std[1]])
        for count in STARTS:
            show(f"λ {alpha:g}, {count} starts", rows[count])


def start_errors(problem, seed, repeat, alpha):
    """(len(STARTS), 2), errors of the best of the first starts."""
    known = toy.subset(seed, repeat)
    X, y = problem.X_target, problem.y_target
    fitted = toy.make_paper_transfer(
        problem.source, repeat, max(STARTS), alpha
    ).fit(X[known], y[known])
    cost = [start.cost for start in fitted.starts_]
    errors = []
    for count in STARTS:
        best = fitted.starts_[int(np.argmin(cost[:count]))]
        moved = fitted.mapping_.apply(best.parameters, X)
        squared = (problem.source.predict(moved) - y) ** 2
        errors.append((squared[known].mean(), squared[~known].mean()))
    return errors


def choose_prior(seeds, repeats):
    """Errors of the default, without and with further inputs."""
    problems = {s: toy.make_problem(toy.DOMAINS["unit"], s) for s in seeds}
    print("\nprior: default, by weights of inside and shape")
    for inside, shape in itertools.product((3.0, 10.0, 30.0), repeat=2):
        weights = {"_INSIDE": inside, "_SHAPE": shape}
        show_prior(f"inside {inside:g}, shape {shape:g}", "default", weights,
                   problems, repeats)  # fmt: skip
    print("\nprior: other 15 inputs too, by weights of inside and moments")
    for inside, moments in itertools.product((0.1, 0.3, 3.0), repeat=2):
        weights = {"_MANY_INSIDE": inside, "_MANY_MOMENTS": moments}
        show_prior(f"inside {inside:g}, moments {moments:g}", "unlabelled",
                   weights, problems, repeats)  # fmt: skip


def show_prior(label, name, weights, problems, repeats):
    """The errors of a method with other weights of its prior."""
    with mock.patch.multiple(transfer, **weights):
        rows = [
            [other_errors(name, problem, seed, repeats)]
            for seed, problem in problems.items()
        ]
    show(label, rows)


CHOICES = {
    "source": choose_source,
    "squares": choose_square,
    "starts": choose_starts,
    "prior": choose_prior,
}


def main() -> None:
    """Prints the tables asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--only", nargs="+", choices=list(CHOICES))
    args = parser.parse_args()
    # Five points do not determine six parameters: that is the experiment.
    warnings.simplefilter("ignore", UserWarning)
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    for name in args.only or CHOICES:
        CHOICES[name](seeds, args.repeats)


if __name__ == "__main__":
    main()
