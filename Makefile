# drivebridge: everything that is done around the code. `make help` lists it.
#
# PYTHON=...  the interpreter for .venv     (default: the first Python >= 3.11 found)
# LAB=0       leave out the tests that need a CAN interface, and the Debian packages they need
# APT=0       install no Debian packages, only say which are missing
# JOBS=n      how many tests run at a time; 0 in this process, as a debugger wants  (default: CPUs)
# FUZZ=s      how long make fuzz takes for each protocol, in seconds  (default: 600)
# PROTOCOL=.. the one that make fuzz throws at: opcua, modbus, zenoh or can  (default: all)
# SEED=n      a number that make fuzz, make plant or make compare has printed, to do the same again
# KNOWN=...   a regular expression: faults that make fuzz lets pass, to find others
# REPLAY=...  a file that make fuzz has kept: throw what it has; REDUCE=1 finds the few cases that do it
# ARGS=...    further arguments, e.g. make unit ARGS='-k watchdog -x'

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
MAKEFLAGS += --no-builtin-rules

LAB ?= 1
export APT ?= 1
export PYTHON
JOBS ?= $(shell n=$$(nproc); echo $$((n < 8 ? n : 8)))
ARGS ?=

VENV := .venv
IN := $(VENV)/bin/python
# Modules, not the scripts in bin/: those carry the path at which the venv was made.
PIP := $(IN) -m pip --disable-pip-version-check
PYTEST := $(IN) -m pytest
QUIETLY := tools/quietly $(VENV)/install.log

# Unit tests know no time. The others do: few of them run at a time, a module of them in one place.
FEW_JOBS := $(shell echo $$(($(JOBS) < 2 ? $(JOBS) : 2)))
WIRE_JOBS := $(shell echo $$(($(JOBS) < 2 ? $(JOBS) : 3)))
# What takes real time is tried once more where it fails: a machine that others use, too, may have stood still. The
# summary names it, and AGAIN= turns it off. Unit tests have no such excuse.
AGAIN ?= --reruns 1 -rR
PAGES := tests/wire/test_docs.py
BROWSER := tests/browser

# The lab runs on slow CPUs as root: it leaves no caches behind and gets a time limit.
LAB_SECONDS := 1800
ON_VCAN := PYTHON=$(IN) PYTHONDONTWRITEBYTECODE=1
VCAN := $(ON_VCAN) tests/lab/vcan-run -n 2 -t $(LAB_SECONDS) --
LAB_RUN := $(ON_VCAN) tests/lab/run-lab -j $(FEW_JOBS) -t $(LAB_SECONDS) --
PACKAGES := iproute2:ip kmod:insmod can-utils:cansend mbpoll:mbpoll nodejs:node npm:npm chromium:chromium openssl:openssl
CLIENTS := tests/wire/node
# What the web page and the OPC UA server are built on is fetched when the package is installed.
FETCHED := tools/build_hook.py tools/fetched.py tools/nodesets.py tools/page_scripts.py bridge/northbound/page/package-lock.json
FOREIGN := build/foreign
REGISTRIES := $(if $(filter 0,$(LAB)),PyPI,all)

##@ Run
demo: $(VENV)/demo.stamp ## start everything on simulated drives, on loopback, until Ctrl-C
	@exec $(IN) -m bridge demo $(ARGS)

##@ Test
# What measures times minds when it has to wait for a CPU: one after the other, and never two at a time. Unit tests
# know no time. A tab of a browser is a controller whose silence stops a drive: beside it nothing else runs.
test: compiled packages clients ## unit, foreign, wire, lab, docs, browser, some fuzzing, plants; less of what takes long
	@$(IN) -m tools.side_by_side "$(MAKE)" "wire lab pages fuzz-short" "foreign unit plant-short"
	@$(MAKE) --no-print-directory browser

# What changes seldom break, and what is like what runs already: LANDING=1 make unit runs both, of one part.
landing: export LANDING := rest
landing: compiled packages clients ## what make test leaves out, before a change lands: .ci/run has both
	@$(IN) -m tools.side_by_side "$(MAKE)" "wire lab pages fuzz-short" "unit"
	@$(MAKE) --no-print-directory browser

# One after the other, so that nobody disturbs who measures times; and all of them even if one fails.
nightly: export NIGHTLY := 1
nightly: compiled packages clients ## the same, with all examples and with what takes long: an hour, for a timer
	@$(MAKE) --no-print-directory -k unit foreign wire lab pages browser fuzz-short plant-short

# Beside the others they get what these leave of the CPUs.
unit: $(VENV)/dev.stamp ## tests of the code alone
	@echo "== unit tests"
	@$(PYTEST) -n $(JOBS) -o timeout=600 tests/unit $(ARGS)

foreign: compiled $(FOREIGN)/$(REGISTRIES).stamp ## EDS and XDD files of other people's packages: read, simulated, served
	@echo "== device descriptions of other people's packages"
	@LAB=$(LAB) $(PYTEST) -p no:cacheprovider -s tests/foreign $(ARGS)

# None of these files is ours to pass on.
$(FOREIGN)/$(REGISTRIES).stamp: tools/foreign_files.py | $(VENV)/dev.stamp packages
	@echo "Fetching the device descriptions of other people's packages into $(FOREIGN)"
	@$(QUIETLY) $(IN) -m tools.foreign_files $(FOREIGN) $(if $(filter 0,$(LAB)),--without npm)
	@touch $@

wire: compiled packages clients ## tests with real protocol clients on loopback
	@echo "== wire tests"
	@$(PYTEST) -n $(WIRE_JOBS) --dist loadfile -rs $(AGAIN) tests/wire $(patsubst %,--ignore %,$(PAGES)) $(ARGS)

pages: compiled packages clients ## the commands of README and docs, as a reader gives them
	@echo "== README and docs"
	@$(PYTEST) -rs $(AGAIN) $(PAGES) $(ARGS)

browser: compiled packages clients ## the web page in Chromium
	@echo "== the web page in Chromium"
	@$(PYTEST) -n $(FEW_JOBS) --dist loadfile -rs $(AGAIN) $(BROWSER) $(ARGS)

ifeq ($(LAB),0)
lab:
	@echo "== LAB=0: the lab tests, on real SocketCAN, were NOT run"

packages clients:
	@echo "LAB=0: nothing is installed for $@; wire tests that need it skip themselves"
else
lab: compiled packages ## tests on real SocketCAN: vcan, or a user-mode kernel that has it
	@echo "== lab tests ($$(PYTHON=$(IN) tests/lab/vcan-run -w | sed 's/here/on vcan of this kernel/;s/uml/in a user-mode kernel: this one has no vcan/'))"
	@$(LAB_RUN) $(PYTEST) -rs $(AGAIN) -p no:cacheprovider --timeout=120 tests/lab $(ARGS)

packages: $(VENV)/dev.stamp ## install the Debian packages that the tests need
	@tools/need-packages "the tests (LAB=0 leaves those on a CAN bus out)" $(PACKAGES)
	@[ "$$(PYTHON=$(IN) tests/lab/vcan-run -w)" = here ] || \
	  tools/need-packages "the lab tests: this kernel has no vcan (LAB=0 leaves them out)" user-mode-linux:linux.uml \
	    $$(! grep -qw amx_tile /proc/cpuinfo || echo build-essential:cc)

clients: $(CLIENTS)/node_modules/made.stamp

$(CLIENTS)/node_modules/made.stamp: $(CLIENTS)/package-lock.json | packages
	@echo "Installing the clients of the wire tests that come from npm"
	@$(QUIETLY) npm --prefix $(CLIENTS) ci --no-audit --no-fund
	@touch $@
endif

# Each test that starts a process would compile all of it anew where nothing may be written.
compiled: $(VENV)/dev.stamp
	@$(IN) -m compileall -q bridge tests/peers tests/support

fuzz-short: compiled ## half a minute of fuzzing, always the same cases
	@echo "== fuzzing, two protocols at a time"
	@$(PYTEST) -p no:cacheprovider -rs tests/fuzz $(ARGS)

FUZZ ?= 600

fuzz: compiled ## throw changed messages at the bridge, 10 minutes for each protocol
	@$(IN) -m tests.fuzz $(PROTOCOL) --seconds $(FUZZ) $(SEED:%=--seed %) $(REPLAY:%=--replay %) $(if $(REDUCE),--reduce) $(if $(KNOWN),--known '$(KNOWN)')

# Half of the drives on each CPU. A run that fails prints its seed, and the least steps that it takes.
PLANT_S ?= 60

plant: compiled ## whole plants on one seeded clock, for a minute of each CPU, another seed each day (SEED=n, PLANT_S=s)
	@echo "== plants on one clock"
	@PROOF_PLANT=second $(IN) -m tests.plant --seconds $(PLANT_S) $(SEED:%=--seed %) $(ARGS) & other=$$!; \
	  PROOF_PLANT=first $(IN) -m tests.plant --seconds $(PLANT_S) $(SEED:%=--seed %) $(ARGS); one=$$?; \
	  wait $$other && exit $$one

# One plant after the other: beside other lanes it gets part of a CPU.
PLANT_SHORT_S := $(if $(NIGHTLY),300,12)

plant-short: compiled
	@echo "== plants on one clock, one after the other"
	@for plant in first second calm; do \
	  PROOF_PLANT=$$plant $(IN) -m tests.plant --minutes 2 --seconds $(PLANT_SHORT_S) || exit 1; done

plant-long: PLANT_S = 3600
plant-long: compiled ## the same for an hour of each CPU, what was gone through in build/plant.md (PLANT_S=s)
	@$(MAKE) --no-print-directory plant PLANT_S=$(PLANT_S) ARGS='--out build $(ARGS)' || failed=1; \
	  $(IN) -m tests.plant.figures build/plant.first.json build/plant.second.json > build/plant.md; \
	  echo "build/plant.md"; exit $${failed:-0}

plant-mutants: compiled ## seed faults in the chain, which plants have to find (half an hour; ARGS='"no gap"')
	@mkdir -p build && $(IN) -m tests.plant.mutants --json build/plant-mutants.json $(ARGS)

# Atheris has no wheel for every machine: it is installed where it is asked for.
GUIDED_S ?= 20
DEEP_S ?= 1800

$(VENV)/guided.stamp: $(VENV)/dev.stamp
	@echo "Installing Atheris into $(VENV)"
	@$(QUIETLY) $(PIP) install --no-build-isolation -c requirements.lock -e '.[dev,fuzz]'
	@touch $@

fuzz-guided: compiled $(VENV)/guided.stamp ## fuzz every codec and parser, guided by coverage: 20 s each, two at a time
	@echo "== fuzzing guided by coverage"
	@$(IN) -m tests.fuzz.guided $(PARSERS) --seconds $(GUIDED_S) $(ARGS)

fuzz-deep: compiled $(VENV)/guided.stamp ## the same for hours, and what covers something new is kept (DEEP_S=s for each)
	@$(IN) -m tests.fuzz.guided $(PARSERS) --seconds $(DEEP_S) --keep $(ARGS)

CASES ?= 2000

compare: compiled packages clients ## ask our OPC UA server, open62541 and node-opcua the same (SEED=n, CASES=2000, an hour)
	@$(IN) -m tests.compare --cases $(CASES) $(SEED:%=--seed %) $(ARGS)

bench: compiled packages ## measure everything in half an hour, write docs/explanation/performance.md (ARGS='--rounds 1')
	@$(ON_VCAN) $(IN) -m tests.bench $(if $(filter 0,$(LAB)),--no-lab) --json build/bench.json --plots docs/images docs/explanation/performance.md $(ARGS)

# Half of the drives on each of two machines. PROOF=n: how many times each fault is injected.
PROOF ?= 12
PROOF_PAGES = docs/explanation/proof.md docs/reference/proof-figures.md

proof: compiled packages ## inject every fault 12 times, write the pages of the proof (an hour)
	@$(ON_VCAN) tests/proof/run-proof -j $(FEW_JOBS) -n $(PROOF) -o build/proof.json $(PROOF_PAGES)

proof-mutants: compiled packages ## seed faults in the chain, which the proof has to find (half an hour)
	@$(ON_VCAN) tests/proof/run-proof -m -j $(FEW_JOBS) -o build/mutants.json $(PROOF_PAGES)

mutants: compiled ## change the code and see whether unit tests notice: hours, or ARGS='bridge/canopen/sdo.py'
	@$(IN) -m tools.mutants --jobs $(FEW_JOBS) $(ARGS)

##@ Check
check: check-style check-format check-types check-scripts check-imports ## style, format, types, import rules (-k: all of them even if one fails)

check-style: $(VENV)/dev.stamp
	@echo "== ruff check"
	@$(IN) -m ruff check

check-format: $(VENV)/dev.stamp
	@echo "== ruff format --check"
	@$(IN) -m ruff format --check

check-types: $(VENV)/dev.stamp
	@echo "== pyright, strict"
	@$(IN) -m pyright

# tsc comes from npm, with the clients of the wire tests.
check-scripts: $(VENV)/dev.stamp clients
ifeq ($(LAB),0)
	@echo "LAB=0: the page's scripts were NOT checked"
else
	@echo "== tsc, the page's scripts"
	@$(CLIENTS)/node_modules/.bin/tsc -p bridge/northbound/page
endif

check-imports: $(VENV)/dev.stamp
	@echo "== import rules"
	@$(IN) -c 'from importlinter.cli import lint_imports_command as main; main()' --no-cache --no-logo

house: $(VENV)/dev.stamp ## print what is measured of the code: rooms, circles, what is found in too many of them
	@$(IN) -m tools.house

format: $(VENV)/dev.stamp ## put the code into the format that check asks for
	@$(IN) -m ruff check --fix
	@$(IN) -m ruff format

docs: $(VENV)/dev.stamp ## write the pages that are made from the mapping files
	@$(IN) -m tools.family_pages

##@ Set up and build
setup: $(VENV)/dev.stamp ## make .venv with everything for demo, test and check

$(VENV)/made.stamp: tools/make-venv
	@tools/make-venv $(VENV) requirements.lock
	@touch $@

$(VENV)/demo.stamp: $(VENV)/made.stamp pyproject.toml requirements.lock $(FETCHED)
	@echo "Installing drivebridge into $(VENV)"
	@$(QUIETLY) $(PIP) install --no-build-isolation -c requirements.lock -e '.[dbc]'
	@touch $@

$(VENV)/dev.stamp: $(VENV)/made.stamp pyproject.toml requirements.lock $(FETCHED)
	@echo "Installing drivebridge and the tools for its tests into $(VENV)"
	@$(QUIETLY) $(PIP) install --no-build-isolation -c requirements.lock -e '.[dev]'
	@touch $@ $(VENV)/demo.stamp

lock: ## write requirements.lock anew with today's versions
	@folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; new=$$folder/venv/bin/python; \
	  tools/make-venv "$$folder/venv"; \
	  echo "Resolving today's versions"; \
	  tools/quietly "$$folder/log" "$$new" -m pip install --no-build-isolation -e '.[dev,fuzz]'; \
	  { echo "# Every package of .venv, for pip's -c. Written by \`make lock\` with $$("$$new" --version)."; \
	    "$$new" -m pip freeze --exclude-editable; } >"$$folder/lock"; \
	  ! grep -n '@\|file:' "$$folder/lock"; \
	  cp "$$folder/lock" requirements.lock
	@echo "requirements.lock: $$(grep -c == requirements.lock) packages"

wheel: $(VENV)/dev.stamp ## build the wheel and the source archive into dist/
	@echo "Building dist/"
	@$(QUIETLY) $(IN) -m build --no-isolation
	@ls -1 dist

clean: ## remove .venv and everything that was built
	@echo "Removing .venv, dist and caches"
	@rm -rf $(VENV) dist build .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	@find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +

help: ## this list
	@awk -F ':.*## ' '/^##@/ { printf "\n%s\n", substr($$0, 5) } /^[a-z-]+:.*## / { printf "  make %-14s %s\n", $$1, $$2 }' Makefile
	@echo; sed -n 's/^# \([A-Z]*=\)/  \1/p' Makefile

.PHONY: demo test landing nightly unit foreign wire pages browser lab packages clients compiled fuzz fuzz-short fuzz-guided fuzz-deep plant plant-short plant-long plant-mutants compare bench proof proof-mutants mutants check check-style check-format check-types check-scripts house \
  check-imports format docs setup lock wheel clean help
