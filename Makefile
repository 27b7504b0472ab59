# The two commands of the README are `make run` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SCENARIO ?= worst_case

.PHONY: help run test test-fast lint bench coverage clean
help: ## show this list
	@grep -hE '^[a-z-]+:.*## ' Makefile | sed -E 's/:.*## /\t/' | expand -t 12

run: $(VENV)/run.stamp ## build what a run needs and simulate the worst-case sea (SCENARIO=calm for another)
	$(BIN)/cspm run $(SCENARIO)

test: $(VENV)/test.stamp ## build what the tests need; lint, types, fast tests, then the slow ones
	$(MAKE) --no-print-directory lint
	$(BIN)/python -m pytest

test-fast: $(VENV)/test.stamp ## the tests without the slow ones
	$(BIN)/python -m pytest -m "not slow"

lint: $(VENV)/test.stamp ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

coverage: $(VENV)/test.stamp ## line coverage with the kernels uncompiled
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -m "not slow and not compiled" --cov --cov-report=term --cov-report=html

bench: $(VENV)/test.stamp ## measure speed, start-up and memory; prints a table
	$(BIN)/python -m bench

clean: ## remove the environment and caches
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache

$(VENV)/pip.stamp:
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "cspm: python3 needs its venv module (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1; }
	touch $@

$(VENV)/run.stamp: $(VENV)/pip.stamp pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check -e .
	touch $@

$(VENV)/test.stamp: $(VENV)/run.stamp pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@
