# Needs git, make and Python >= 3.11 with venv and pip. Locked versions of everything else are installed in .venv.

PYTHON ?= python3
CORES ?= 2
CONFIG ?=
# Series of random cases in tests/test_every_case_ends.py; each series has a hundred cases.
SERIES ?= 1

export PATH := $(CURDIR)/.venv/bin:$(PATH)
export UV_PYTHON_DOWNLOADS := never
export UV_PROJECT_ENVIRONMENT := $(CURDIR)/.venv
export UV_NO_PROGRESS := 1
# Compile modules once, not in each process.
export UV_COMPILE_BYTECODE := 1
unexport VIRTUAL_ENV PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help publish environment tamaas slurm-environment run validation hysteresis test test-all random-cases audit wheel lint format schema docs linkcheck benchmarks short-range indenter jkr-test applicability validators-environment validate clean

help:
	@echo "make run            run the campaign of config/config.yaml, or of CONFIG=FILE, on $(CORES) cores"
	@echo "make publish        run that campaign and make its deposit; see docs/howto/publish.md"
	@echo "make validation     run the campaign validation (two hours) and write the tables and figures of docs/validation.md"
	@echo "make hysteresis     run the campaign hysteresis (a quarter of an hour) and write the tables and figures of docs/hysteresis.md"
	@echo "make tamaas         install Tamaas, an independent code, for comparisons in validation and tests"
	@echo "make test           run the quick tests (three minutes): physics, every rule, wrong input"
	@echo "make test-all       run all tests: more random cases, kills, resumption, Slurm, a browser, deposits"
	@echo "make random-cases   run two thousand random cases; make test-all runs a hundred of them (SERIES=7: other ones)"
	@echo "make audit          check the locked packages for known vulnerabilities (part of make test-all; needs network)"
	@echo "make wheel          build the sdist, and the wheel from the sdist, in dist/"
	@echo "make lint           check the style of the Python code and the workflow"
	@echo "make format         format the Python code and the workflow"
	@echo "make schema         write the JSON schema of the configuration, and the tables of config/README.md"
	@echo "make docs           build the documentation as a website in docs/_build/html; broken internal links are errors"
	@echo "make linkcheck      check the links of the documentation to other websites"
	@echo "make benchmarks     measure ICHA and other codes (four hours; OPTIONS='--only icha'); see docs/benchmarks.md"
	@echo "make short-range    compare boundary elements with closed forms (ten minutes); see docs/short_range.md"
	@echo "make indenter       compare indenters with closed forms and ContactMechanics (five minutes); see docs/indenter.md"
	@echo "make jkr-test       count how often intervals of JKR tests contain the truth (ten minutes); see docs/estimates.md"
	@echo "make applicability  compare asperities with boundary elements on sixty surfaces (ten minutes); see docs/limits.md"
	@echo "make slurm-environment  install Snakemake and its Slurm executor in .venv-slurm; see docs/howto/cluster.md"
	@echo "make validate DEPOSIT=FOLDER_OR_ZIP  check a deposit with programs of other projects, without network"
	@echo "make clean          remove results, the records of Snakemake and the built documentation, not the environment"

environment: .venv/.installed

# Checksums of all installed files are verified: pip verifies uv, and uv verifies everything else.
.venv-tools/bin/uv: workflow/envs/uv.txt
	$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "ICHA needs Python 3.11 or newer")'
	$(PYTHON) -m venv .venv-tools
	.venv-tools/bin/python -m pip install --quiet --require-hashes --requirement workflow/envs/uv.txt
	@touch $@

.venv/.installed: .venv-tools/bin/uv pyproject.toml uv.lock
	.venv-tools/bin/uv sync --quiet --locked $(if $(wildcard .venv/.tamaas),,--no-group tamaas) --python $(PYTHON)
	@touch $@

# Once Tamaas is installed, later updates of the environment keep it.
.venv/.tamaas: .venv/.installed
	.venv-tools/bin/uv sync --quiet --locked --python $(PYTHON)
	@touch $@

tamaas: .venv/.tamaas

# In a separate environment, because the Slurm executor makes every start of Snakemake slower.
.venv-slurm/.installed: .venv-tools/bin/uv pyproject.toml uv.lock
	UV_PROJECT_ENVIRONMENT=$(CURDIR)/.venv-slurm .venv-tools/bin/uv sync --quiet --locked --no-default-groups --extra slurm --python $(PYTHON)
	@touch $@

slurm-environment: .venv-slurm/.installed

run: environment
	@icha run $(CONFIG) --cores $(CORES) $(OPTIONS)

publish: environment
	@icha run $(CONFIG) publish --cores $(CORES)

# Comparisons of ICHA with other results. Each target writes tables that a page of the documentation includes.
validation: tamaas
	$(MAKE) run CONFIG=config/campaigns/validation.yaml
	python -m validation.model_error
	python -m validation.one_asperity

# One run fails a check; docs/hysteresis.md states why.
hysteresis: environment
	-$(MAKE) run CONFIG=config/campaigns/hysteresis.yaml
	python -m validation.hysteresis

indenter: .venv-benchmarks/.installed
short-range: tamaas
indenter jkr-test applicability: environment
short-range indenter jkr-test applicability:
	python -m validation.$(subst -,_,$@) $(OPTIONS)

test: tamaas
	pytest -n $(CORES) --dist worksteal -m "not slow"

# All tests with more random cases, in one process more than there are cores, because many of them wait.
test-all: tamaas audit
	pytest -n $$(($(CORES) + 1)) --dist loadfile --hypothesis-profile thorough --series $(SERIES)

random-cases: SERIES = 1-20
random-cases: environment
	pytest -n $(CORES) --dist worksteal --hypothesis-profile thorough --series $(SERIES) tests/test_every_case_ends.py

# Looks up the locked packages in the database OSV. Without a network the audit is skipped with a message.
audit: environment
	@python tests/packaging/audit.py $(OPTIONS)

# The wheel is built from the sdist, so that a file missing in the sdist is also missing in the wheel.
wheel: .venv-tools/bin/uv
	rm -rf dist
	.venv-tools/bin/uv build --quiet

lint: environment
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

# The other codes are in a separate environment. If aspher cannot be built, it is omitted.
.venv-benchmarks/.installed: .venv-tools/bin/uv benchmarks/requirements.txt benchmarks/requirements-aspher.txt
	.venv-tools/bin/uv venv --quiet --clear --python $(PYTHON) .venv-benchmarks
	.venv-tools/bin/uv pip sync --quiet --require-hashes --python .venv-benchmarks/bin/python benchmarks/requirements.txt
	-.venv-tools/bin/uv pip install --quiet --python .venv-benchmarks/bin/python -r benchmarks/requirements-aspher.txt
	@touch $@

benchmarks: environment .venv-benchmarks/.installed
	python benchmarks/run.py $(OPTIONS)
	python -m benchmarks.tables

# The validators are in a separate environment, because some of them need an old version of jsonschema.
.venv-validators/.installed: .venv-tools/bin/uv tests/validators/requirements.txt
	.venv-tools/bin/uv venv --quiet --clear --python $(PYTHON) .venv-validators
	.venv-tools/bin/uv pip sync --quiet --require-hashes --python .venv-validators/bin/python tests/validators/requirements.txt
	@touch $@

validators-environment: .venv-validators/.installed

# Neither make nor the shell interprets special characters in the name of a deposit.
override DEPOSIT := $(value DEPOSIT)
export DEPOSIT

validate: validators-environment
	@.venv-validators/bin/python tests/validators/validate.py "$${DEPOSIT:?expected DEPOSIT=FOLDER_OR_ZIP}"

clean:
	rm -rf .snakemake docs/_build
	find results -mindepth 1 -not -name README.md -delete
