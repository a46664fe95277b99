# Needs git, make and Python >= 3.11 with venv and pip; everything else is installed, locked, into .venv.

PYTHON ?= python3
CORES ?= 2
CONFIG ?=
# Of the random cases of tests/test_every_case_ends.py, a hundred each.
SERIES ?= 1

export PATH := $(CURDIR)/.venv/bin:$(PATH)
export UV_PYTHON_DOWNLOADS := never
export UV_PROJECT_ENVIRONMENT := $(CURDIR)/.venv
export UV_NO_PROGRESS := 1
# Libraries are compiled once, even where Python is told to write no bytecode.
export UV_COMPILE_BYTECODE := 1
unexport VIRTUAL_ENV PYTHONPATH PYTHONHOME

.DEFAULT_GOAL := help
.PHONY: help publish environment tamaas slurm-environment run validation hysteresis test test-all random-cases audit wheel lint format schema docs linkcheck benchmarks short-range error-sources faults validators-environment validate clean

help:
	@echo "make run     run the campaign of config/config.yaml (or of CONFIG=FILE) on $(CORES) cores"
	@echo "make publish make the deposit of that campaign, and before it what is missing; docs/howto/publish.md"
	@echo "make validation  run campaign validation (two hours) and write the tables and figures of docs/validation.md"
	@echo "make hysteresis  run campaign hysteresis (forty minutes) and write the tables and figures of docs/hysteresis.md"
	@echo "make tamaas  install Tamaas as well, for boundary elements at finite ranges (campaign validation, tests)"
	@echo "make test    run the quick tests (three minutes): physics, every rule, wrong input"
	@echo "make test-all  run them with more random cases, and all others: kills, resumption, Slurm, browser, deposits"
	@echo "make random-cases  two thousand random runs, of which make test-all has a hundred (another one: SERIES=7)"
	@echo "make audit   ask whether vulnerabilities of the locked packages are known (part of test-all; needs network)"
	@echo "make wheel   build the sdist, and from it the wheel, in dist/"
	@echo "make lint    check style of Python code and workflow"
	@echo "make format  put Python code and workflow into that style"
	@echo "make schema  write the configuration's JSON schema and config/README.md's tables from its model"
	@echo "make docs    build the documentation as a site in docs/_build/html; broken links within it are errors"
	@echo "make linkcheck  check the documentation's links to other sites"
	@echo "make benchmarks  measure ICHA and boundary-element codes (four hours; OPTIONS='--only icha'); docs/benchmarks.md"
	@echo "make short-range  hold boundary elements in the limit of short range against what is known (ten minutes); docs/short_range.md"
	@echo "make error-sources  solve variants between the model and boundary elements (half an hour); docs/error_sources.md"
	@echo "make faults  kill, damage and starve a small campaign (an hour or two, as root); docs/faults.md"
	@echo "make slurm-environment  install Snakemake with its executor for Slurm in .venv-slurm; docs/howto/cluster.md"
	@echo "make validate DEPOSIT=FOLDER_OR_ZIP  put a deposit to the validators of others, without network"
	@echo "make clean   remove results, Snakemake's records and the built documentation (not the environment)"

environment: .venv/.installed

# Whatever is installed is what its checksum says: uv by the list of pip, all else by uv.lock and lists like it.
.venv-tools/bin/uv: workflow/envs/uv.txt
	$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "ICHA needs Python 3.11 or newer")'
	$(PYTHON) -m venv .venv-tools
	.venv-tools/bin/python -m pip install --quiet --require-hashes --requirement workflow/envs/uv.txt
	@touch $@

.venv/.installed: .venv-tools/bin/uv pyproject.toml uv.lock
	.venv-tools/bin/uv sync --quiet --locked $(if $(wildcard .venv/.tamaas),,--no-group tamaas) --python $(PYTHON)
	@touch $@

# What is there once stays there.
.venv/.tamaas: .venv/.installed
	.venv-tools/bin/uv sync --quiet --locked --python $(PYTHON)
	@touch $@

tamaas: .venv/.tamaas

# An environment of its own, for what Snakemake needs to talk to Slurm slows every start. See docs/howto/cluster.md.
.venv-slurm/.installed: .venv-tools/bin/uv pyproject.toml uv.lock profiles/slurm/executor/pyproject.toml
	UV_PROJECT_ENVIRONMENT=$(CURDIR)/.venv-slurm .venv-tools/bin/uv sync --quiet --locked --no-default-groups --extra slurm --extra tamaas --python $(PYTHON)
	.venv-tools/bin/uv pip install --quiet --no-deps --python .venv-slurm/bin/python --editable profiles/slurm/executor
	@touch $@

slurm-environment: .venv-slurm/.installed

run: environment
	@icha run $(CONFIG) --cores $(CORES) $(OPTIONS)

publish: environment
	@icha run $(CONFIG) publish --cores $(CORES)

# What ICHA is held against, for the pages of the documentation: each target writes tables that a page includes.
validation: tamaas
	$(MAKE) run CONFIG=config/campaigns/validation.yaml
	python -m validation.model_error
	python -m validation.one_asperity

hysteresis: environment
	$(MAKE) run CONFIG=config/campaigns/hysteresis.yaml
	python -m validation.hysteresis

short-range error-sources: tamaas
	python -m validation.$(subst -,_,$@) $(OPTIONS)

test: tamaas
	pytest -n $(CORES) --dist worksteal -m "not slow" $(THOROUGH)

# The quick tests with more random cases, and with what they cover of the physics (pyproject.toml, tool.coverage); then
# the slow ones, in one process more than there are cores, since many of them wait.
test-all: THOROUGH = --hypothesis-profile thorough --cov --cov-report=term
test-all: test audit
	pytest -n $$(($(CORES) + 1)) --dist loadfile -m slow --series $(SERIES)

random-cases: SERIES = 1-20
random-cases: environment
	pytest -n $(CORES) --dist worksteal --hypothesis-profile thorough --series $(SERIES) tests/test_every_case_ends.py

# Known vulnerabilities of the locked packages, by the database OSV; skipped, with the reason, where it cannot be asked.
audit: environment
	@python tests/packaging/audit.py $(OPTIONS)

# From the sdist, so that nothing that it lacks is in the wheel.
wheel: .venv-tools/bin/uv
	rm -rf dist
	.venv-tools/bin/uv build --quiet

lint: tamaas
	ruff check .
	ruff format --check .
	lint-imports
	mypy
	snakefmt --check Snakefile workflow
	codespell
	snakemake --lint

format: environment
	ruff check --fix .
	ruff format .
	snakefmt Snakefile workflow

schema: environment
	python -m icha.configuration.schema

docs: environment
	sphinx-build --quiet --fail-on-warning --keep-going -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

linkcheck: environment
	sphinx-build --quiet --keep-going -b linkcheck docs docs/_build/linkcheck

# The codes compared with have an environment of their own; where aspher cannot be built, the page says so.
.venv-benchmarks/.installed: .venv-tools/bin/uv benchmarks/requirements.txt benchmarks/requirements-aspher.txt
	.venv-tools/bin/uv venv --quiet --clear --python $(PYTHON) .venv-benchmarks
	.venv-tools/bin/uv pip sync --quiet --require-hashes --python .venv-benchmarks/bin/python benchmarks/requirements.txt
	-.venv-tools/bin/uv pip install --quiet --python .venv-benchmarks/bin/python -r benchmarks/requirements-aspher.txt
	@touch $@

benchmarks: tamaas .venv-benchmarks/.installed
	python benchmarks/run.py $(OPTIONS)
	python -m benchmarks.tables

faults: tamaas
	python -m validation.faults $(OPTIONS)

# The validators have an environment of their own, for some of them need an old jsonschema.
.venv-validators/.installed: .venv-tools/bin/uv tests/validators/requirements.txt
	.venv-tools/bin/uv venv --quiet --clear --python $(PYTHON) .venv-validators
	.venv-tools/bin/uv pip sync --quiet --require-hashes --python .venv-validators/bin/python tests/validators/requirements.txt
	@touch $@

validators-environment: .venv-validators/.installed

# Neither make nor the shell reads what is in a name.
override DEPOSIT := $(value DEPOSIT)
export DEPOSIT

validate: validators-environment
	@.venv-validators/bin/python tests/validators/validate.py $(OPTIONS) -- "$${DEPOSIT:?needed: a folder or zip}"

clean:
	rm -rf .snakemake docs/_build
	find results -mindepth 1 -not -name README.md -delete
