"""Speed, as ratios of things measured in the same run.

    python analysis/benchmarks/benchmark.py [--only NAME ...] [--list]

Each benchmark is a function of a module beside this one that prints a few
lines. Absolute times hold for this machine and this minute; the ratios say
more. CPU time is what is measured, the least of several tries; only for a
study and its start, whose processes share the work, it is the time that
passes.
"""

import argparse
import importlib

# Name → the module beside this one and its function. A benchmark is imported
# only when it runs: the learning core needs no Drake.
BENCHMARKS = {
    "start": ("bench_start", "run"),
    "dmp": ("bench_learning", "dmp"),
    "elm": ("bench_learning", "elm"),
    "transfer": ("bench_learning", "transfer"),
    "pneumatics": ("bench_pneumatics", "run"),
    "station": ("bench_station", "run"),
    "studies": ("bench_studies", "run"),
    "memory": ("bench_studies", "memory"),
}


def main() -> None:
    """Runs the benchmarks that were asked for, in the order of the list."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only", nargs="+", choices=list(BENCHMARKS), metavar="NAME"
    )
    parser.add_argument("--list", action="store_true", help="names, and end")
    args = parser.parse_args()
    if args.list:
        print("\n".join(BENCHMARKS))
        return
    for name in args.only or BENCHMARKS:
        module, function = BENCHMARKS[name]
        print(f"-- {name}", flush=True)
        getattr(importlib.import_module(module), function)()


if __name__ == "__main__":
    main()
