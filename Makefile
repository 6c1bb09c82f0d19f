# SPDX-License-Identifier: GPL-3.0-or-later
# Everything a person does with this project, one target each: see `make help`.

SHELL := /bin/bash
VENV ?= .venv
PYTHON3 ?= python3
PY := $(VENV)/bin/python
PIP := $(PY) -m pip --disable-pip-version-check -q
export PYTHON ?= $(abspath $(PY))

SPEED ?=
WEB ?=
JOB ?=
CONFIG ?=
REPORT ?= report
API ?= /tmp/klippy_uds
TESTS ?= test
# Of a soak
HOURS ?= 24
JOBS ?= 200
SEED ?= 1
# How tests are spread over the cores
SPREAD ?= -n auto --dist loadfile

# As people are used to: with a configuration there, plain `make` builds firmware
.DEFAULT_GOAL := $(if $(wildcard .config),firmware,help)

##@ Use
.PHONY: help
help: ## Show this list
	@awk 'BEGIN {FS = ":.*## "} \
	  /^##@/ {printf "\n%s\n", substr($$0, 5)} \
	  /^[a-zA-Z0-9_.-]+:.*## / {printf "  %-16s %s\n", $$1, $$2}' \
	  $(MAKEFILE_LIST)
	@echo
	@echo "Variables: SPEED=1 (run in real time, then serve API=$(API)), WEB=1 (show a web page), CONFIG= JOB= (of run), TESTS=path (of test)"

.PHONY: run
run: setup-run host simulator ## Print a sliced file on the simulated machine
	$(PY) -m klippy demo --report $(REPORT) \
	  $(if $(SPEED),--speed $(SPEED) --api-server $(API)) $(if $(WEB),--web) \
	  $(if $(CONFIG),--config $(CONFIG)) $(JOB)

.PHONY: check
check: host simulator ## Check a printer.cfg: make check CONFIG=printer.cfg
	$(PY) -m klippy check $(CONFIG)

.PHONY: docs
docs: host ## Write the references of docs/, and the table of firmware features
	$(PY) scripts/feature_table.py
	$(PY) -m klippy schema --markdown docs

##@ Develop
.PHONY: test
test: setup-test setup-clients host simulator ## Run the test suite, installing what it needs
	KLIPPY_PURE=1 $(PY) -m pytest test/unit -m "not slow" -p no:cacheprovider $(SPREAD)
	@# first all that lives in virtual time, then what needs the cores for itself
	$(PY) -m pytest $(TESTS) -m "not realtime and not slow" $(SPREAD) || test $$? = 5
	$(PY) -m pytest $(TESTS) -m "realtime and not slow" || test $$? = 5

.PHONY: test-slow
test-slow: setup-test host simulator ## Run the long proofs, which `test` leaves out
	$(PY) -m pytest $(TESTS) -m "slow and not realtime" $(SPREAD) || test $$? = 5
	$(PY) -m pytest $(TESTS) -m "slow and realtime" || test $$? = 5

.PHONY: soak
soak: setup-test host simulator ## Live HOURS=24 with JOBS=200 and all faults in virtual time
	$(PY) test/soak/soak.py --hours $(HOURS) --jobs $(JOBS) --seed $(SEED) \
	  --report soak.png

.PHONY: test-clients
test-clients: setup-test setup-clients host simulator ## Have real Moonraker and OctoPrint drive the daemon
	$(PY) -m pytest test/clients -rs

.PHONY: test-systemd
test-systemd: setup-test host simulator ## Run the service under a real systemd, in a container
	PYTHON=$(PYTHON3) sh scripts/system_packages.sh systemd
	$(PY) -m pytest test/service -m "" -rs

.PHONY: test-vm
test-vm: setup-test setup-vm host ## Try the links on a kernel's CAN and USB, in a virtual machine
	$(PY) -m pytest test/vm -m "" -rs

.PHONY: lint
lint: setup-lint ## Check style: ruff, cython-lint
	$(PY) -m ruff check klippy klippy_ext scripts test setup.py
	PATH="$(abspath $(VENV))/bin:$$PATH" cython-lint klippy_ext klippy

.PHONY: bench
bench: setup-test host simulator ## Measure speed: whole files, moves/s, ns a step, instructions
	$(PY) scripts/bench_table.py
	$(PY) -m pytest test/bench -o norecursedirs= --benchmark-columns=min,median,rounds

.PHONY: bench-firmware
bench-firmware: setup-test ## Measure the firmware on emulated chips: CHIPS="stm32f103 lpc1768"
	$(PY) test/emulator/bench_firmware.py $(CHIPS)

.PHONY: fuzz
fuzz: setup-test host ## Fuzz the parsers: make fuzz FUZZ_SECONDS=600
	FUZZ_SECONDS=$(or $(FUZZ_SECONDS),60) $(PY) -m pytest test/c/test_fuzz.py

.PHONY: fuzz-firmware
fuzz-firmware: setup-test ## Fuzz the firmware's commands: FUZZ_SECONDS= (default 600)
	$(PY) test/firmware/fuzz_firmware.py --seconds $(or $(FUZZ_SECONDS),600)

.PHONY: mutation
mutation: setup-test ## Make 100 faults in the firmware, count those the tests see: MUTATION="--seed 2"
	$(PY) test/mutation $(MUTATION)

.PHONY: nightly
nightly: setup-vm $(VENV)/stamp-registers test-slow ## What takes too long for each change: slow proofs, fuzzers, faults
	$(PY) -m pytest test/firmware -k registers -rs $(SPREAD)
	KLIPPY_HYPOTHESIS=explore $(PY) -m pytest test/unit $(SPREAD)
	$(MAKE) --no-print-directory fuzz FUZZ_SECONDS=600
	$(MAKE) --no-print-directory fuzz-firmware FUZZ_SECONDS=600
	$(MAKE) --no-print-directory mutation

##@ Build
.PHONY: host
host: $(VENV)/stamp-run ## Compile the host software in place
	$(PY) setup.py -q build_ext --inplace
	$(PY) -m compileall -q klippy klippy_ext

.PHONY: simulator
simulator: $(VENV)/stamp-run ## Build the simulator firmware
	$(MAKE) --no-print-directory firmware OUT=out-simulator/ \
	  KCONFIG_CONFIG=test/configs/simulator.config

.PHONY: wheel
wheel: $(VENV)/stamp-run ## Build an installable wheel into dist/
	$(PIP) install build
	$(PY) -m build --wheel --outdir dist .

.PHONY: wheels
wheels: $(VENV)/stamp-run ## Build and try wheels for several Pythons and boards: make wheels WHEELS="cp311-*"
	PYTHON=$(PYTHON3) sh scripts/system_packages.sh wheels
	$(PIP) install "ziglang>=0.13" "auditwheel>=6" "wheel>=0.45"
	$(PY) scripts/wheels $(WHEELS)

$(VENV)/bin/python:
	PYTHON=$(PYTHON3) sh scripts/system_packages.sh run
	$(PYTHON3) -m venv $(VENV)

$(VENV)/stamp-run: $(VENV)/bin/python pyproject.toml
	$(PIP) install "setuptools>=77" "cython>=3.1" "kconfiglib>=14.1" \
	  "greenlet>=3.0" "jinja2>=3.1" "pyserial>=3.5" \
	  "numpy>=1.26" "matplotlib>=3.8"
	touch $@

$(VENV)/stamp-test: $(VENV)/stamp-run
	$(PIP) install "pytest>=8" "pytest-xdist>=3.5" "pytest-benchmark>=5" "hypothesis>=6.100" \
	  "cffi>=1.16" "unicorn>=2.1" "jsonschema>=4.20" build
	$(PIP) install "atheris>=2.3" || echo "no atheris here: two fuzz tests are skipped"
	touch $@

# Facts about registers, 800 MB of them
$(VENV)/stamp-registers: $(VENV)/stamp-test
	$(PIP) install cmsis-svd==0.4
	touch $@

$(VENV)/stamp-lint: $(VENV)/bin/python
	$(PIP) install "ruff>=0.8" "cython-lint>=0.16"
	touch $@

.PHONY: setup-run setup-test setup-lint setup-clients setup-vm
setup-run: $(VENV)/stamp-run
setup-test: $(VENV)/stamp-test
	PYTHON=$(PYTHON3) sh scripts/system_packages.sh test
setup-lint: $(VENV)/stamp-lint
setup-clients: $(VENV)/stamp-run
	$(PY) test/clients/packages.py

setup-vm: $(VENV)/stamp-run
	PYTHON=$(PYTHON3) sh scripts/system_packages.sh vm
	sh scripts/fetch_vm_kernel.sh

include src/firmware.mk

##@ Tidy
.PHONY: clean
clean: ## Remove what builds made, keep the configuration and the venv
	rm -rf build out out-* dist report *.egg-info .pytest_cache .hypothesis \
	  .ruff_cache .benchmarks
	find klippy klippy_ext test -name '*.so' -delete
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

.PHONY: distclean
distclean: clean ## Remove everything that is not under version control
	rm -rf $(VENV) .config .config.old
