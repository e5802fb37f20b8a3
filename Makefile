## Start
# make demo   install into .venv and run the main job (no torch)
# make test   install everything the tests need and run them
# make help   list all targets

PYTHON ?= python3
VENV ?= .venv
# Installed first and pinned, so that no package pulls in a build with CUDA. `make test TORCH=` goes without.
TORCH ?= torch==2.13.0
PYTEST_ARGS ?= -n auto

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet
comma := ,
LOCKED := requirements/constraints.txt
EXAMPLES := docs/examples/legible-emitter-example docs/examples/legible-workspace-example

.PHONY: help demo test test-benchmarks test-reliability lint format docs bench lock clean
.DEFAULT_GOAL := help

help:
	@awk '/^## / { print (n++ ? "\n" : "") substr($$0, 4) ":" } \
	  /^# make / { name = $$3; sub(/^# make [^ ]+ +/, ""); printf "  make %-17s%s\n", name, $$0 }' $(MAKEFILE_LIST)

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python >= 3.11 is needed; '$(PYTHON)' is $$($(PYTHON) --version 2>&1). Try: make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.run-installed: $(LOCKED) pyproject.toml | $(BIN)/python
	@echo "Installing into $(VENV) (pinned versions) ..."
	$(PIP) -c $(LOCKED) -e .
	@touch $@

$(VENV)/.test-installed: $(LOCKED) pyproject.toml | $(BIN)/python
	@echo "Installing the test environment into $(VENV) (pinned versions) ..."
	$(if $(TORCH),$(PIP) $(TORCH))
	$(PIP) -c $(LOCKED) -e '.[dev,distributed,docs,minari,multiagent,study$(if $(TORCH),$(comma)rl)]'
	$(PIP) -c $(LOCKED) --no-deps $(EXAMPLES:%=-e %)
	@touch $@ $(VENV)/.run-installed

demo: $(VENV)/.run-installed
	$(BIN)/legible demo --out runs/demo

test: $(VENV)/.test-installed
	$(BIN)/legible humans fetch || [ "$${LEGIBLE_REQUIRE_DATA:-0}" = 0 ]
	$(BIN)/python -m pytest $(PYTEST_ARGS)

## Check
# make test-benchmarks   the tests that take minutes each
test-benchmarks: $(VENV)/.test-installed
	$(BIN)/python -m pytest -m benchmark

# make test-reliability   kills, flipped bits and malformed files by the thousand (docs/reliability.md); takes hours
test-reliability: $(VENV)/.test-installed
	$(BIN)/python -m pytest tests/reliability --thorough --timeout 0 $(PYTEST_ARGS)

# make lint   style, formatting, spelling, types and import rules
lint: $(VENV)/.test-installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

## Write
# make format   put the code into the project's style
format: $(VENV)/.test-installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# make docs   build the site, docs/_build/html; warnings are errors
docs: $(VENV)/.test-installed
	rm -rf docs/_build docs/environments/Legible*
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html

## Speed
# make bench   speed, as ratios within one run, with peers beside it
bench: $(VENV)/.run-installed
	$(BIN)/legible bench --peers --out docs/benchmarks.md

## Maintain
# make lock   pin the newest versions that fit pyproject.toml
lock: | $(BIN)/python
	$(PIP) uv
	$(BIN)/uv pip compile --quiet --universal --upgrade --python-version 3.11 --no-emit-index-url --no-emit-find-links \
	  --no-header --no-annotate pyproject.toml --extra dev --extra distributed --extra minari --extra multiagent --extra study --extra docs -o $(LOCKED)
	echo "torch==2.13.0" >> $(LOCKED)
	# Without their dependencies: torch would bring its builds with CUDA, all others are pinned above.
	printf '%s\n' absl-py grpcio markdown protobuf sb3-contrib stable-baselines3 tensorboard tensorboard-data-server werkzeug | \
	  $(BIN)/uv pip compile --quiet --no-deps --upgrade --python-version 3.11 \
	  --no-emit-index-url --no-emit-find-links --no-header --no-annotate - >> $(LOCKED)

# make clean   remove environments, caches and runs
clean:
	rm -rf .venv .venv-* runs build dist docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
