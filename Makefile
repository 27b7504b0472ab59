# The two commands of the README are `make run` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Says every ten seconds that an installation goes on, which by itself would take a page or be silent.
PIP := ( s=0; while sleep 10 > /dev/null 2>&1; do s=$$((s + 10)); echo "cspm: installing, $$s s"; done ) & \
  ticker=$$!; trap 'kill $$ticker' EXIT; trap 'exit 130' INT TERM; \
  $(BIN)/python -m pip install --quiet --disable-pip-version-check
SCENARIO ?= worst_case worst_case_past_thesis
# More workers than processors: tests of real time and of ROS 2 wait more than they compute. Each
# begins with its share of the files in order, and takes over from another what that has not begun:
# all end together, and few files are set up twice.
WORKERS ?= $(shell $(PYTHON) -c 'import os; print(os.cpu_count() * 3 // 2)')
SPREAD := -n $(WORKERS) --dist worksteal

# A process per node imports some 200 modules of this project: compiled anew each time, unless kept.
unexport PYTHONDONTWRITEBYTECODE

# ROS 2 Jazzy comes as wheels, unless a native one is sourced. Both at once would mix their libraries.
ROS := wheels
ifeq ($(ROS_DISTRO),jazzy)
ifneq ($(wildcard $(addsuffix /rclpy/_rclpy_pybind11*.so,$(subst :, ,$(PYTHONPATH)))),)
ROS := native
# Its plugins for pytest are written for the pytest of its own distribution.
export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
export PYTEST_ADDOPTS := -p pytest_cov -p xdist
endif
endif

.PHONY: docs help run test test-fast test-slow kernels lint bench fuzz validate results coverage clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*## ' Makefile | sed -E 's/:.*## /\t/' | expand -t 12

run: $(VENV)/$(ROS).stamp ## build what a run needs and simulate the worst-case sea under two controllers (SCENARIO=calm for another)
	@$(BIN)/cspm run $(SCENARIO)

test: lint kernels ## build what the tests need; then style, types and all tests
	$(BIN)/python -m pytest $(SPREAD)

test-fast: $(VENV)/test.stamp ## the tests without the slow ones
	$(BIN)/python -m pytest $(SPREAD) -m "not slow"

# Each worker would rewrite the assertions of all tests for itself, at 20 s of processor time.
kernels: $(VENV)/test.stamp ## compile what all runs and tests share, so that no two workers do it at once
	@$(BIN)/cspm run calm --duration 0.01 --no-record > /dev/null
	@$(BIN)/python -m pytest --collect-only -q > /dev/null

lint: $(VENV)/test.stamp ## style, spelling and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell
	$(BIN)/mypy

coverage: $(VENV)/test.stamp ## line coverage with the kernels uncompiled
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -m "not slow and not compiled" --cov --cov-report=term --cov-report=html

docs: $(VENV)/docs.stamp ## build the site into build/site, without a network
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

bench: $(VENV)/test.stamp ## measure speed, start-up and memory; prints a table
	$(BIN)/python -m bench

fuzz: $(VENV)/test.stamp ## 10 000 tables, damaged bags and mappings through the import, half an hour
	CSPM_FUZZ_EXAMPLES=10000 $(BIN)/python -m pytest $(SPREAD) tests/cspm_ident/importing/test_import_fuzz.py

validate: $(VENV)/test.stamp ## measure over many runs what tests hold over few, and write results/validation-runs.md; half an hour
	OMP_NUM_THREADS=1 $(BIN)/python -m bench.validation

results: $(VENV)/test.stamp ## docs/results.md, half an hour, and results/steep-sea.md, two hours where .results keeps nothing
	OMP_NUM_THREADS=1 $(BIN)/python -m bench.results.reproduction
	OMP_NUM_THREADS=1 $(BIN)/python -m bench.results

clean: ## remove the environment and caches
	rm -rf $(VENV) build install log *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis htmlcov .coverage
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/pip.stamp:
	@echo "cspm: building the environment in $(VENV), about a minute"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "cspm: $(PYTHON) is older than 3.10, allowed: make PYTHON=python3.10 or newer" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { rm -rf $(VENV); echo "cspm: $(PYTHON) lacks its venv module (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1; }
	@touch $@

$(VENV)/docs.stamp: $(VENV)/$(ROS).stamp
	@$(PIP) -e '.[docs]'
	@touch $@

# Bytecode of some thousand modules would be made that a run never imports.
$(VENV)/wheels.stamp: $(VENV)/pip.stamp pyproject.toml setup.cfg
	@$(PIP) --no-compile -e '.[ros]'
	@rm -f $(VENV)/native.stamp
	@touch $@

$(VENV)/native.stamp: $(VENV)/pip.stamp pyproject.toml setup.cfg
	@echo "cspm: using the ROS 2 Jazzy that is sourced"
	@$(PIP) -e '.[ros-native]'
	@$(BIN)/python -m pip uninstall --quiet --yes ros-wheels-bootstrapper 2>/dev/null
	@rm -f $(VENV)/wheels.stamp
	@touch $@

$(VENV)/test.stamp: $(VENV)/$(ROS).stamp
	@echo "cspm: adding what the tests need"
	@$(PIP) -e '.[test,docs]'
	@touch $@
