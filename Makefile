# Everything happens in .venv, made on first use. PYTHON names the interpreter it is made with.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ATLAS := build/atlas.nc

.DEFAULT_GOAL := help
.PHONY: help install atlas dist seeds bitcode equilibria drag stability test docs bench failures types check figures clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 10

install: $(VENV)/installed  ## make .venv and install the package into it

# atlas/__init__.py holds the version, which the installation records.
$(VENV)/installed: pyproject.toml atlas/__init__.py
	$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if (3, 11) <= v < (3, 14) else "towatlas needs Python 3.11 to 3.13, this is %d.%d" % v)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[test,bench,check]'
	@touch $@

atlas: install  ## compile what is compiled once, and build build/atlas.nc
	$(BIN)/python -m towatlas warmup
	$(BIN)/python -m towatlas build --out $(ATLAS)

# The atlas lies among the modules only while it is packed: in a clone it would hide that there is none in build.
dist: atlas  ## build/dist: a wheel with the atlas in it, and the sources with it and the tests
	$(BIN)/pip install --quiet --disable-pip-version-check build
	cp $(ATLAS) atlas/tables/atlas.nc
	$(BIN)/pyproject-build --outdir build/dist; done=$$?; rm -f atlas/tables/atlas.nc; exit $$done

seeds: atlas  ## shorten the series of build/atlas.nc into atlas/solve/fold_series.npz, which direct solutions start from
	$(BIN)/python -m towatlas.builders.fold_series $(ATLAS)

bitcode: install  ## compile the kernels as far as is the same for every processor, into kernels/bitcode.zip
	$(BIN)/python -m towatlas.kernels.packing

equilibria: install  ## build build/equilibria.nc, the table of fish positions
	$(BIN)/python -m towatlas build --equilibria

drag: install  ## build build/atlas.nc with the folds with drag in it; some minutes
	$(BIN)/python -m towatlas build --drag --out $(ATLAS)

stability: install  ## build build/stability.nc, an atlas with growth rates in it; some minutes
	$(BIN)/python -m towatlas build --stability --out build/stability.nc

# Two processes run tests side by side, and threads of BLAS would wait for each other.
test: export OPENBLAS_NUM_THREADS = 1
test: install  ## run the tests, on two cores
	$(BIN)/python -m pytest -n 2 --dist loadfile

# Once, so that the site is built offline after that.
$(VENV)/docs-installed: $(VENV)/installed
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@

docs: $(VENV)/docs-installed  ## build the site, build/site; a warning or a link that leads nowhere is an error
	@rm -rf build/site
	$(BIN)/python -m sphinx -q -W --keep-going -E -d build/doctrees docs build/site
	$(BIN)/python -m benchmarks.links build/site

bench: install  ## chart error against time, compare the ratios, update docs and README
	-$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[peers]'
	$(BIN)/python -m benchmarks.models
	$(BIN)/python -m benchmarks
	$(BIN)/python -m benchmarks.waiting
	$(BIN)/python -m benchmarks.validation

failures: install  ## map where methods fail, write the figure and the tables of docs/failures.md
	$(BIN)/python -m benchmarks.failures

types: install  ## mypy, on the package laid out as it is installed
	@rm -rf build/tree && mkdir -p build/tree/towatlas
	@ln -s $(CURDIR)/atlas/* $(CURDIR)/kernels build/tree/towatlas/
	$(BIN)/mypy

check: types  ## ruff, types, import layers
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	PYTHONPATH=build/tree $(BIN)/lint-imports --no-logo

figures: install  ## draw the figures of the README from build/atlas.nc, and the pages of the sources (build/*.html)
	@test -f $(ATLAS) || $(MAKE) --no-print-directory atlas
	$(BIN)/python -m towatlas plot critical --atlas $(ATLAS) --out docs/critical.svg
	$(BIN)/python -m towatlas plot critical --atlas $(ATLAS) --out docs/critical.png
	$(BIN)/python -m towatlas report nrl7048 --out build/report.html
	$(BIN)/python -m towatlas report cable-body --out build/cable-body.html
	$(BIN)/python -m towatlas report dtmb713 --out build/dtmb713.html
	$(BIN)/python -m towatlas report device --out build/device.html
	$(BIN)/python -m towatlas plot device --out docs/device.svg
	$(BIN)/python -m towatlas diagram --lam 10 --wf 1 --C 0.03 --gamma 0.2:2 --patience 300 --out docs/diagram.svg
	$(BIN)/python -m towatlas explore --patience 600 --out docs/explore.html
	sed -n '/^# chain.toml/,/^```/{/^```/!p}' docs/tutorial.md >build/chain.toml
	$(BIN)/python -m towatlas scene build/chain.toml --out docs/tutorial-shapes.png
	$(BIN)/python -m towatlas diagram build/chain.toml --speed 0.25:0.45 --out docs/tutorial-jump.svg >build/jump.csv
	$(BIN)/python -m benchmarks.notebooks

clean:  ## remove .venv, build and caches
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
