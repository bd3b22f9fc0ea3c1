# `make run` and `make test` do everything, set-up included: a virtual environment, the package and ngspice.
# Choose the interpreter with PYTHON=/path/to/python3.12 and the environment's folder with VENV=/some/folder.

VENV ?= .venv
DESIGN ?= examples/plain_weave.toml
OUT ?= results/$(basename $(notdir $(DESIGN)))
PYTEST_ARGS ?= -n auto --dist loadgroup

PY := $(VENV)/bin/python
export VENV PYTHON

.PHONY: run paper test test-oldest lint style types validation docs clean ngspice gnucap help
.DEFAULT_GOAL := help

help: ## list the targets
	@grep -E '^[a-z-]+:.*##' Makefile | sed -E 's/^([a-z-]+):.*## /make \1\t/' | expand -t 18

run: $(VENV)/.ready ngspice ## compute DESIGN (the plain weave of the paper) into OUT
	$(PY) -m circuittex run $(DESIGN) --out $(OUT)

paper: $(VENV)/.ready ngspice ## the whole study of the paper for both parameter sets, and one report of both
	$(PY) -m circuittex run examples/paper.toml --out results/paper
	$(PY) -m circuittex run examples/paper_table.toml --out results/paper_table
	$(PY) -m circuittex report results/paper --beside results/paper_table

test: $(VENV)/.ready ngspice gnucap ## run the whole test suite
	$(PY) -m pytest $(PYTEST_ARGS)

test-oldest: ## run the test suite with the oldest admitted version of every dependency
	@.ci/setup oldest
	@.ci/setup ngspice
	@.ci/setup gnucap
	$(PY) -m pytest $(PYTEST_ARGS)

lint: style types ## style, format and types

style: $(VENV)/.ready
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

types: $(VENV)/.ready
	$(PY) -m mypy

validation: $(VENV)/.ready ngspice ## hold the program against published measurements: docs/validation.md (minutes)
	$(PY) validation/write.py

docs: $(VENV)/.ready-docs ngspice ## build the documentation into docs/_build, warnings are errors
	$(PY) -m sphinx -W --keep-going -E -q $(SPHINXOPTS) -b html docs docs/_build
	@echo "documentation: docs/_build/index.html"

ngspice: ## install ngspice where it is missing
	@.ci/setup ngspice

gnucap: ## install gnucap where it is missing: a second simulator for the tests
	@.ci/setup gnucap

clean: ## remove the environment, caches and built documentation, but no results
	rm -rf $(VENV) build dist *.egg-info docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find circuittex tests benchmarks validation -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps make repeated calls quick: the environment is renewed when the dependencies or its recipe change.
$(VENV)/.ready: pyproject.toml .ci/setup
	@.ci/setup environment

$(VENV)/.ready-docs: $(VENV)/.ready
	@.ci/setup docs
