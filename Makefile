# bootprint: `make demo` and `make test` set up everything and do their job.
#   make demo ARGS='--headless --duration 60'     make test ARGS='-k radio'
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ROOMS := shared services/sensor-gateway services/pdr-engine services/fusion services/sa-hub proving-ground
READY := $(VENV)/.ready
WEB := services/sa-hub/web
PAGE := services/sa-hub/src/sa_hub/page/static/index.html
PAGE_SOURCES := $(wildcard $(WEB)/*.json $(WEB)/*.ts $(WEB)/*.html $(WEB)/src/*)

.PHONY: help setup page demo test check format golden figures vectors page-load kills fuzz bench storm compose-test wheels constraints clean

help: ## show what there is to make
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 16

setup: $(READY) $(PAGE) ## environment in .venv, every package pinned; the command post's page

$(READY): constraints.txt pyproject.toml $(ROOMS:%=%/pyproject.toml)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "bootprint needs Python 3.11 or newer; try: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade --constraint constraints.txt pip hatchling editables "setuptools<81" setuptools-scm
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --no-build-isolation --group dev $(ROOMS:%=--editable ./%)
	$(BIN)/python -c 'from pdr_engine.foot import warm_up; warm_up()' # compile the foot filter once
	@touch $@

page: $(PAGE) ## build the command post's page (npm packages once)

# Without npm packages (no network) everything else works; the hub says that its page is not built.
$(PAGE): $(PAGE_SOURCES) | $(READY)
	@cd $(WEB) && export PATH="$(CURDIR)/$(BIN):$$PATH" && npm ci && npm run build \
	  || echo "the page is not built, everything else works; 'make page' tries again" >&2

demo: $(READY) $(PAGE) ## eight soldiers clear a building, one picture; ARGS are passed on
	$(BIN)/bootprint demo $(ARGS)

test: $(READY) $(PAGE) ## lint, types and all tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest -n 2 --dist loadgroup $(ARGS)

check: $(READY) ## lint and types only
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: $(READY) ## let ruff format and mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

golden: $(READY) ## write the golden outputs anew (ARGS=--walk: the small recording too); review the difference
	PYTHONPATH=tests $(BIN)/python -m support.golden $(ARGS)

figures: $(READY) $(PAGE) ## make anew the figures and generated pages of the documents
	$(BIN)/bootprint topics > docs/topics.md
	$(BIN)/python -m proving_ground.scenario.keys_page docs/scenarios.md
	$(BIN)/python -m proving_ground.evaluation.foot.figures $(or $(BOOTPRINT_DATA),../shared/data) docs
	$(BIN)/python -m proving_ground.evaluation.body.page $(or $(BOOTPRINT_DATA),../shared/data) docs
	$(BIN)/python -m proving_ground.evaluation.fusion.page docs
	$(BIN)/python -m proving_ground.evaluation.fusion.feet_page $(or $(BOOTPRINT_DATA),../shared/data) docs
	$(BIN)/python -m proving_ground.evaluation.camera.page docs
	$(BIN)/python -m proving_ground.exercises.faults.reliability_page docs
	$(BIN)/python -m proving_ground.evaluation.fusion.rooms_page docs
	$(BIN)/python -m proving_ground.agreement.report $(or $(BOOTPRINT_DATA),../shared/data) docs
	$(BIN)/python -m proving_ground.radio_load.figures $(or $(BOOTPRINT_DATA),../shared/data) docs
	PYTHONPATH=tests $(BIN)/python -m support.page_pictures docs/img

vectors: $(READY) ## write the radio's test vectors anew; review the difference
	PYTHONPATH=tests $(BIN)/python -m support.radio_vectors

page-load: $(READY) $(PAGE) ## hub and page with 500 soldiers at 2 Hz in a real browser (needs Chromium; ARGS='--seconds 60')
	PYTHONPATH=tests $(BIN)/python -m support.page_load $(ARGS)

kills: $(READY) ## kill -9 of a command post's hub in the middle of writing, fifty times on SQLite and on PostgreSQL
	PYTHONPATH=tests $(BIN)/python -m support.killed_hub $(ARGS)

fuzz: $(READY) ## every parser (ARGS='--minutes 60'), then ten million radio frames (FRAMES=100000 for fewer)
	PYTHONPATH=tests $(BIN)/python -m support.parser_fuzz $(ARGS)
	PYTHONPATH=tests $(BIN)/python -m support.radio_fuzz $(if $(FRAMES),--frames $(FRAMES))

bench: $(READY) ## docs/performance.md: what all costs with 1, 8 and 40 soldiers (ARGS='--soldiers 8' for less), beside the last commit's
	$(BIN)/bootprint benchmark all --docs docs $(ARGS)

storm: $(READY) ## an hour of faults of every kind at random (ARGS='--minutes 4' for less, --resume: go on), then docs/reliability.md
	$(BIN)/python -m proving_ground.exercises.faults.storms out/storms $(ARGS); ended=$$?; \
	  $(BIN)/python -m proving_ground.exercises.faults.reliability_page docs out/storms/*/result.json && exit $$ended

compose-test: ## build the images, run docker-compose.yml for real (needs a Docker engine)
	deploy/compose-test

wheels: $(READY) ## all that an installation without a network needs, tried out; ARGS=aarch64: for ARM boards, not tried
	deploy/wheelhouse wheels $(ARGS)
	$(if $(ARGS),,deploy/offline-test wheels)

constraints: ## write constraints.txt anew from a fresh environment (newest versions)
	rm -rf $(VENV)-new && $(PYTHON) -m venv $(VENV)-new
	$(VENV)-new/bin/python -m pip install --quiet --upgrade pip hatchling editables "setuptools<81" setuptools-scm
	$(VENV)-new/bin/python -m pip install --quiet --no-build-isolation --group dev $(ROOMS:%=--editable ./%)
	(echo '# Every package of the house, pinned: the versions everything was tested with. Made by `make constraints`.'; \
	 $(VENV)-new/bin/python -m pip list --format=freeze --exclude-editable | sort -f) > constraints.txt
	rm -rf $(VENV)-new

clean: ## remove the environment and all caches
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis
