# Every target does its own set-up; nothing needs to be installed or activated by hand.
VENV := .venv
PYTHON := $(VENV)/bin/python
# Exact versions, for what is installed and for what builds it.
export PIP_CONSTRAINT := constraints.txt
export PIP_BUILD_CONSTRAINT := constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1
SOURCES := affordance studies examples diagrams docs tests run_experiments.py

.PHONY: run test test-slow coverage lowest wheel dist docs lessons lint format diagrams picture bench calibration numbers kept-numbers release-check robustness-proof clean
.DEFAULT_GOAL := help

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 20

$(PYTHON):
	@python=$$(./.ci/find_python.sh) && "$$python" -m venv $(VENV)

$(VENV)/run.stamp: $(PYTHON) pyproject.toml constraints.txt
	@echo "Installs Drake and other libraries into $(VENV): one to three minutes without further output."
	$(PYTHON) -m pip install --quiet --editable .
	$(PYTHON) -m affordance doctor --install
	@touch $@

$(VENV)/dev.stamp: $(PYTHON) pyproject.toml constraints.txt
	$(PYTHON) -m pip install --quiet --editable '.[dev]'
	$(PYTHON) -m affordance doctor --install --tests
	@touch $@ $(VENV)/run.stamp

$(VENV)/docs.stamp: $(VENV)/run.stamp
	$(PYTHON) -m pip install --quiet --editable '.[docs]'
	@touch $@

run: $(VENV)/run.stamp ## run the four simulations and vision with 100 observers, and write results/report.html
	$(PYTHON) run_experiments.py all --repeats 100
	$(PYTHON) run_experiments.py vision --repeats 100

# Compiled modules are kept, whatever the environment says: processes that tests start would compile them anew.
test: $(VENV)/dev.stamp ## run the test suite without its slow tests: five minutes on two cores
	PYTHONDONTWRITEBYTECODE= $(PYTHON) -m pytest

test-slow: $(VENV)/dev.stamp ## run the slow tests: ten minutes
	PYTHONDONTWRITEBYTECODE= $(PYTHON) -m pytest -m slow

# Workers of pytest and every process that a test starts write files of their own, which are combined (pyproject.toml).
coverage: $(VENV)/dev.stamp ## run the test suite and measure which lines of affordance/ it runs: at least 97 %
	rm -rf build/coverage
	PYTHONDONTWRITEBYTECODE= $(PYTHON) -m coverage run -m pytest -m 'slow or not slow'
	$(PYTHON) -m coverage combine --quiet
	$(PYTHON) -m coverage report

wheel: $(VENV)/dev.stamp ## build the wheel, and use it from an empty environment and another folder
	./.ci/try_wheel.sh

# All pages are read anew: Sphinx forgets for the search what the index has of pages that it does not read.
docs: $(VENV)/docs.stamp ## build the documentation in build/site: some minutes, seconds once its pictures are kept
	OMP_NUM_THREADS=1 $(PYTHON) -m sphinx --quiet --fresh-env --fail-on-warning --keep-going -b html -c docs . build/site
	@echo "The documentation: build/site/index.html"

lessons: $(VENV)/dev.stamp ## execute the lessons and write their outputs into them: two minutes
	OMP_NUM_THREADS=1 $(PYTHON) -m docs.lessons

lowest: $(VENV)/dev.stamp ## run the test suite with the lowest versions of libraries that are allowed, in an environment of its own
	./.ci/try_lowest.sh

dist: $(VENV)/dev.stamp ## build what is released into dist/ and check it
	$(PYTHON) -m pip install --quiet --editable '.[release]'
	rm -rf dist && $(PYTHON) -m build --outdir dist
	$(PYTHON) -m twine check --strict dist/*

lint: $(VENV)/dev.stamp ## check format, style and types
	$(PYTHON) -m ruff format --check $(SOURCES)
	$(PYTHON) -m ruff check $(SOURCES)
	$(PYTHON) -m mypy
	$(VENV)/bin/lint-imports

format: $(VENV)/dev.stamp ## reformat the code and sort its imports
	$(PYTHON) -m ruff check --fix $(SOURCES)
	$(PYTHON) -m ruff format $(SOURCES)

diagrams: $(VENV)/run.stamp ## redraw diagrams/ from the Diagrams that are run
	$(PYTHON) diagrams/redraw.py

picture: $(VENV)/run.stamp ## redraw the moving picture of README from a simulation
	$(PYTHON) -m affordance film weight docs/images/weight.gif --seconds 1 --slower 3

bench: $(VENV)/dev.stamp ## print a table of speeds, as ratios to other programs and to brute force: a minute or two
	OMP_NUM_THREADS=1 $(PYTHON) -m studies.bench

calibration: $(VENV)/run.stamp ## are beliefs as uncertain as they should be? a quarter of an hour on two cores
	$(PYTHON) -m affordance study calibration

numbers: $(VENV)/dev.stamp ## remake what pages quote: outputs of commands, and numbers from results/
	$(PYTHON) -m docs.quoted_outputs
	$(PYTHON) docs/fill_numbers.py
	$(PYTHON) -m affordance study robustness --page

kept-numbers: $(VENV)/dev.stamp ## remake the numbers of every experiment that tests compare with
	cd tests && ../$(PYTHON) -m helpers.shipped_runs

release-check: $(VENV)/dev.stamp docs ## check, before a release, what takes too long for the test suite: half an hour
	$(PYTHON) -m docs.quoted_outputs --check
	OMP_NUM_THREADS=1 $(PYTHON) -m docs.lessons --check
	cd tests && ../$(PYTHON) -m helpers.trunk_tests
	cd tests && ../$(PYTHON) -m helpers.site_check

robustness-proof: $(VENV)/run.stamp ## compare interpolated holds with simulated ones of all observers, in five settings drawn at random
	$(PYTHON) -m affordance study robustness --prove 5

clean: ## remove the environment (results/ stay)
	rm -rf $(VENV)
