# The project sets itself up: every target that needs the virtual environment
# makes it first, and finds it done the next time.

SHELL := /bin/sh
export AFFETTO_VENV ?= .venv
PYTHON := $(AFFETTO_VENV)/bin/python
# pytest processes; the Drake systems run in processes, never in threads.
WORKERS ?= 2
# More words for the command of a target: make demo ARGS="--seed 3"
ARGS ?=

unexport PYTHONPATH PYTHONHOME
# One thread a process: the same figures on every machine, and no contest
# between the processes for the cores.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

.DEFAULT_GOAL := help
.PHONY: help setup demo test quick docs rooms lint format bench clean distclean

help:
	@echo "make demo       run the main job into out/demo"
	@echo "make test       lint, types and all tests"
	@echo "make quick      the tests that are not slow, without lint"
	@echo "make setup      make or update the virtual environment .venv"
	@echo "make lint       ruff's rules and layout, and the types"
	@echo "make format     lay out the code and mend what ruff can mend"
	@echo "make bench      measure the speed of the closed loop"
	@echo "make docs       build the documentation into out/docs, without network"
	@echo "make rooms      draw the package's rooms and imports into docs/"
	@echo "make clean      remove what was built, not .venv and not out/"
	@echo "make distclean  remove .venv and out/ too"
	@echo 'ARGS="..." is handed on: make demo ARGS="--seed 3 --meshcat"'

setup:
	@sh tools/setup_env.sh

demo: setup
	@$(PYTHON) -m drake_affetto.cli demo --out out/demo $(ARGS)

lint: setup
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m ruff format --check .
	@$(PYTHON) -m mypy

format: setup
	@$(PYTHON) -m ruff check --fix .
	@$(PYTHON) -m ruff format .

test: lint
	@DRAKE_DEPRECATION_RUNTIME_SEVERITY=error \
	    $(PYTHON) -m pytest -n $(WORKERS) --dist loadfile $(ARGS)

quick: setup
	@DRAKE_DEPRECATION_RUNTIME_SEVERITY=error \
	    $(PYTHON) -m pytest -n $(WORKERS) --dist loadfile \
	    -m "not slow" $(ARGS)

# Warnings are errors. Tutorials are run, where they or the package changed.
docs: setup
	@$(PYTHON) -m sphinx -W --keep-going -b html -d out/docs-work/doctrees \
	    docs out/docs $(ARGS)
	@echo "docs: out/docs/index.html"

rooms: setup
	@$(PYTHON) tools/draw_rooms.py $(ARGS)

bench: setup
	@$(PYTHON) analysis/benchmarks/benchmark.py $(ARGS)

clean:
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
	rm -rf .hypothesis .coverage docs/tutorials docs/api/rooms
	find . -path './.*' -prune -o -name __pycache__ -type d \
	    -exec rm -rf {} +

distclean: clean
	rm -rf .venv out
