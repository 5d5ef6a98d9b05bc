# Everything that a person runs here, from a bare machine on: Python >= 3.11, make, and a package index.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test coverage check docs install clean

demo: $(VENV)/installed  ## scene 1 with four camera processes and the central one, and how they compare
	$(BIN)/dcpf run scenarios/scene1.yaml

test: $(VENV)/installed-dev check  ## all checks and all tests
	$(BIN)/python -m pytest --durations=15

coverage: $(VENV)/installed-dev  ## which lines no test runs; the tests take a third longer
	$(BIN)/coverage run -m pytest
	$(BIN)/coverage report --skip-covered --skip-empty

check: $(VENV)/installed-dev  ## style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/installed-dev  ## these pages as a site that needs no network, in build/site; broken links are errors
	$(BIN)/python -m sphinx --fresh-env --write-all --fail-on-warning --keep-going --quiet docs build/site
	@echo build/site/index.html

install: $(VENV)/installed  ## the environment in .venv, with the dcpf command

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	touch $@

$(VENV)/installed-dev: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache .coverage
