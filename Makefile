# `make` lists the targets. Only Python 3.11 or newer and make are needed.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
MINUTES ?= 60
KIND ?= each
# Tests wait for live machines for part of their time: three processes keep two cores busy.
WORKERS ?= 3
MUTATED ?= rig/guard.py rig/guarded.py rig/limits.py rig/envelope.py rig/sensing.py rig/opening.py rig/replay.py control/live machines/guarding.py machines/lines.py machines/homing.py serve/stage/_control.py serve/stage/_playing.py serve/stage/_machine.py
SOAK ?= results/soak.md
TRIAL ?= results/trial.md
MATRIX ?= results/matrix.md
# Tests start hundreds of processes; each would compile this package if it left no bytecode behind.
PYTEST := env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run serve test test-docs test-slow test-all browser compiler avr arm wine firmware hex firmware-arm maker trial lint format dist quick bench bench-peers bench-identify soak matrix mutants docs beyond notebooks site clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile

run: $(VENV)/.core ## run the thesis' integrated test, and two laws side by side; in results/
	$(BIN)/macromicro run --out results/thesis --overwrite
	$(BIN)/macromicro run fast --law pd-tuned,pi-antiwindup --out results/fast/thesis --overwrite
	$(BIN)/macromicro run fast --law terminal,inverse --out results/fast/own --overwrite
	$(BIN)/macromicro compare results/fast/thesis results/fast/own \
	  --out results/fast/compare --overwrite

serve: $(VENV)/.core ## serve the virtual bench live: SCPI and a page, until Ctrl-C
	$(BIN)/macromicro serve

# Each worker would rewrite all assertions of a fresh checkout.
test: $(VENV)/.dev ## run the tests
	@[ -d tests/serve/__pycache__ ] || ls -d tests/*/ tests/*.py | xargs -P 2 -n 16 \
	  $(PYTEST) --collect-only -qq >/dev/null 2>&1 || true
	$(PYTEST) -n $(WORKERS) --no-loadscope-reorder -m "not slow"

test-docs: $(VENV)/.dev ## run every code block of README and docs, the examples and the notebooks
	$(PYTEST) -n $(WORKERS) -m slow tests/test_blocks.py tests/test_readme.py tests/test_examples.py tests/tools/website

test-slow: $(VENV)/.dev ## run the slow tests alone
	$(PYTEST) -m slow

test-all: $(VENV)/.dev ## run the tests, slow ones too, and print the coverage
	$(PYTEST) -n $(WORKERS) --cov

# $(call debian,CHECK,PACKAGES): Debian's packages, unless a command says that they are here.
define debian
@{ $(1); } >/dev/null 2>&1 && exit 0; \
command -v apt-get >/dev/null || { echo "no apt-get here: install $(2) yourself"; exit 1; }; \
if [ "$$(id -u)" = 0 ]; then root=; else root=sudo; fi; \
[ -z "$$root" ] || command -v sudo >/dev/null || { echo "run make $@ as root"; exit 1; }; \
$$root apt-get update -qq && $$root env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends $(2)
endef

# Chromium travels with its libraries, so only the system's packages can bring it.
browser: ## install Debian's chromium for the browser tests
	$(call debian,command -v chromium && command -v chromedriver,chromium chromium-driver)

compiler: ## install Debian's C compiler, for exported code and FMUs
	$(call debian,command -v cc,gcc libc6-dev)

avr: ## install Debian's compiler and simulator of AVR microcontrollers, for the firmware
	$(call debian,command -v avr-gcc && cat /usr/include/simavr/sim_avr.h /usr/include/libelf.h,gcc-avr \
	  avr-libc binutils-avr simavr libsimavr-dev libelf-dev)

arm: ## install Debian's compiler and simulator of a Cortex-M, for the firmware's proof on it
	$(call debian,command -v arm-none-eabi-gcc && command -v qemu-system-arm,gcc-arm-none-eabi \
	  libnewlib-arm-none-eabi qemu-system-arm)

wine: ## install Debian's Wine, which loads the libraries that are built for Windows
	$(call debian,command -v wine,wine wine64)

firmware: $(VENV)/.core ## build the firmware of the boards, in build/firmware
	PYTHONPATH=tools $(BIN)/python -m boardcode --out build/firmware
	$(MAKE) --no-print-directory -C firmware

hex: firmware ## renew the built firmware that the package carries, with its SHA-256
	cp build/firmware/atmega328p.hex src/macromicro/rig/board/uno.hex
	cd src/macromicro/rig/board && sha256sum uno.hex > uno.hex.sha256

firmware-arm: $(VENV)/.core ## build the firmware's core for a Cortex-M4F, which QEMU runs
	PYTHONPATH=tools $(BIN)/python -m boardcode --out build/firmware
	$(MAKE) --no-print-directory -C firmware mps2

maker: $(VENV)/.dev ## follow docs/board.md on the simulated board, command by command (a quarter of an hour)
	$(PYTEST) -m "slow or not slow" tests/firmware/test_build_one.py

trial: firmware ## random orders and injuries before the simulated board for MINUTES=60 of its time; TRIAL=
	PYTHONPATH=tools:docs $(BIN)/python -m boardtrial --minutes $(MINUTES) --out $(TRIAL)

lint: $(VENV)/.dev ## check format, style, types and the layers
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	@printf '%s\n' mypy lint-imports | xargs -P 2 -I{} sh -c '$(BIN)/{}'

format: $(VENV)/.dev ## format the code and sort its imports
	$(BIN)/ruff check --fix-only --quiet .
	$(BIN)/ruff format .

dist: $(VENV)/.dev ## build the wheel and the source archive in dist/, and check them
	rm -rf dist
	$(BIN)/python -m build --no-isolation
	$(BIN)/python -m twine check --strict dist/*

bench: $(VENV)/.core ## measure the speed
	@$(INSTALL) -e ".[figures,sweep]"
	$(BIN)/python benchmarks/bench.py

bench-peers: $(VENV)/.core ## one job by the package, C and other simulators (2.6 GB, minutes)
	$(BIN)/python benchmarks/peers/compare.py

bench-identify: $(VENV)/.core ## long files; do the errors that identify prints hold? docs/validation/identification.md (half an hour)
	$(BIN)/python benchmarks/reading.py
	$(BIN)/python benchmarks/intervals.py
	$(BIN)/python docs/make_coverage.py

# Those of the variants also identify a bench of each stage.
QUICK := "docs/make_beyond_variants.py --quick --kind macro" \
  "docs/make_beyond_variants.py --quick --kind micro" \
  "benchmarks/bench.py --quick" "benchmarks/peers/compare.py --quick" \
  "benchmarks/reading.py 20000" "benchmarks/intervals.py --quick" \
  $(patsubst %,"docs/make_%.py --quick", \
    beyond beyond_micro beyond_both bench used actuator figures commissioning examples calibrate)
quick: $(VENV)/.dev ## run every maker of figures for a moment, to see that it still runs
	@printf '%s\n' $(QUICK) | xargs -P $(WORKERS) -I{} \
	  sh -c 'echo "{}"; $(BIN)/python {} || { echo "failed: {}"; exit 1; }'
	@if command -v chromium >/dev/null; then $(BIN)/python docs/make_screenshots.py --quick; fi

mutants: $(VENV)/.dev ## do the tests notice a wrong sign, term, latch? MUTATED="rig/guard.py control/live"
	$(BIN)/python tools/mutants $(MUTATED) --jobs 2

matrix: $(VENV)/.core ## every fault in every mode of each kind of machine, judged by truth; FAULTS=--quick: some
	PYTHONPATH=tools:docs $(BIN)/python -m faultmatrix --workers $(WORKERS) --out $(MATRIX) $(FAULTS)

soak: $(VENV)/.core ## serve under random commands and faults for MINUTES=60; KIND=slide SOAK=
	PYTHONPATH=tools:docs $(BIN)/python -m soak --kind $(KIND) --minutes $(MINUTES) --out $(SOAK)

docs: $(VENV)/.core ## measure anew what the documents say, and draw their figures
	$(BIN)/python docs/make_bench.py
	$(BIN)/python docs/make_used.py
	$(BIN)/python docs/make_coverage.py
	$(BIN)/python docs/make_scpi.py
	$(BIN)/python docs/make_commands.py
	$(BIN)/python docs/make_settings.py
	$(BIN)/python docs/make_examples.py
	$(BIN)/python docs/make_architecture.py
	$(BIN)/python docs/make_figures.py
	@if command -v chromium >/dev/null; then set -x; $(BIN)/python docs/make_screenshots.py; \
	else echo "no picture of the page without chromium: make browser"; fi

beyond: $(VENV)/.core ## measure anew docs/validation/beyond.md: some hours
	$(BIN)/python docs/make_beyond.py
	$(BIN)/python docs/make_beyond_micro.py
	$(BIN)/python docs/make_beyond_variants.py
	$(BIN)/python docs/make_beyond_both.py
	$(BIN)/python docs/make_beyond_summary.py

notebooks: $(VENV)/.core ## execute the notebooks anew, from their scripts
	@$(INSTALL) -e ".[notebooks]"
	PYTHONPATH=tools $(BIN)/python -m website.notebooks

site: $(VENV)/.core ## build the documentation as a site that works without a network; in build/site
	@$(INSTALL) -e ".[docs]"
	$(BIN)/python docs/make_twin.py
	rm -rf build/site
	PYTHONPATH=tools $(BIN)/python -m sphinx -q -W --keep-going -j 2 -b html -c tools/website -d build/site-trees . build/site
	@echo build/site/index.html

clean: ## delete the virtual environment and all caches; results stay
	@if [ -e "$(VENV)/.made" ]; then rm -rf "$(VENV)"; fi
	rm -rf .venv-peers
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .coverage* build dist
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Python 3.11 or newer is needed; name one: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }
	@echo "making a virtual environment in $(VENV)"
	@$(PYTHON) -m venv "$(VENV)"
	@touch $@

$(VENV)/.core: pyproject.toml constraints.txt | $(VENV)/.made
	@echo "installing macromicro and what it needs, about a minute"
	@$(INSTALL) -e ".[figures,sweep]"
	@touch $@

# What the tests need includes what a run needs.
$(VENV)/.dev: pyproject.toml constraints.txt | $(VENV)/.made
	@echo "installing macromicro and its development tools, about a minute"
	@$(INSTALL) -e ".[dev]"
	@touch $(VENV)/.core $@
