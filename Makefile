# `make demo` sets everything up and runs the main job; `make test` runs every test.
.DEFAULT_GOAL := help
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
TOOLS := $(VENV)/.tools
SOURCES := $(shell find rust python -name '*.rs' -o -name '*.toml' -o -name 'pyproject.toml') \
	Cargo.toml Cargo.lock pyproject.toml .cargo/config.toml

RECORDINGS ?= ../shared/data

# A wheel to install in the place of the sources, as .ci/run has built one.
WHEEL ?=
PACKAGE = $(if $(WHEEL),'$(WHEEL)[all]',--editable '.[all]')
# The path of uv, where it is to install in the place of pip, in a tenth of the time.
UV ?=
INSTALL = $(if $(UV),$(UV) pip install --python $(BIN)/python,$(BIN)/pip install) --quiet

.PHONY: help demo wheel clean-systems minimal free-threaded board test test-core test-package nightly fuzz fuzz-core lint lint-core lint-package docs links bench ratchet ratchet-renew results compare clean check-python check-cargo check-valgrind

help: ## Show this help
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

demo: $(STAMP) ## Simulate a gyro, filter it, write the log and the figure into demo/
	@echo "simulating a gyro for 600 s and filtering it; log and figure go to demo/"
	$(BIN)/zerorate demo --output demo --force
	@echo "done: open demo/demo-zerorate.png"

wheel: | check-python check-cargo ## Build the wheel of this machine into target/wheel and look what is in it
	rm -rf target/wheel
	$(PYTHON) -m pip wheel --quiet --no-deps --wheel-dir target/wheel .
	$(PYTHON) .ci/wheel.py target/wheel

SYSTEMS ?= bookworm trixie noble

clean-systems: wheel ## Do what the README tells in new systems of Debian and Ubuntu, as root, by debootstrap
	.ci/clean target/wheel/zerorate-*.whl $(SYSTEMS)

# What pyproject.toml says is enough.
minimal: wheel ## Test the package with the oldest version of each dependency
	$(PYTHON) -m venv --clear target/minimal
	target/minimal/bin/pip install --quiet --upgrade 'pip>=25.1'
	$(PYTHON) .ci/minimal.py > target/minimal/oldest.txt
	target/minimal/bin/pip install --quiet --constraint target/minimal/oldest.txt --group test \
		"$$(echo target/wheel/*.whl)[all]"
	target/minimal/bin/python -m pytest -W default --numprocesses=logical --dist=worksteal

FREE_THREADED ?= python3.14t
# What needs no package that is built with the lock alone.
FREE_THREADED_TESTS := drift attitude/test_tilt.py laws limits/test_interrupt.py \
	--ignore laws/test_roads.py --ignore laws/test_samples_with_names.py

free-threaded: | check-cargo ## Build for FREE_THREADED (python3.14t), and test filters and threads there
	$(FREE_THREADED) -m venv --clear target/free-threaded
	target/free-threaded/bin/pip install --quiet . pytest pytest-xdist hypothesis scipy pandas \
		pyarrow matplotlib jsonschema statsmodels PyWavelets pygeomag
	target/free-threaded/bin/python -W error -c \
		"import sys, zerorate; zerorate.DriftFilter(100.0); assert not sys._is_gil_enabled()"
	cd tests && ../target/free-threaded/bin/python -m pytest --numprocesses=logical \
		-W default $(FREE_THREADED_TESTS)

test: test-package test-core ## Run all tests of the core and of the package

# What lint-core checks, so that both ask the same features of dependencies and have one build of
# the compiler's plug-ins.
WORKSPACE := --workspace --exclude zerorate-bare

test-core: | check-cargo
	cargo test --quiet $(WORKSPACE)

# Not --numprocesses=auto, which counts one for the two threads of a core.
test-package: $(TOOLS)
	$(BIN)/python -m pytest --numprocesses=logical --dist=worksteal

# What takes too long for every change: deep searches, the core's laws in every order, its tests and
# its example without its default feature, the benches of times, each once, the filters in a library
# with neither std nor an allocator, whose lints would check all dependencies once more.
nightly: $(TOOLS) ## Test for an hour or two what .ci/run tests for minutes
	HYPOTHESIS_PROFILE=deep ZERORATE_HISTORIES=2000 \
		$(BIN)/python -m pytest --numprocesses=logical --dist=worksteal --slow
	PROPTEST_CASES=5000 ZERORATE_HISTORIES=25000 ZR_EVERY_ORDER=1 \
		cargo test --quiet --release --package zerorate-core
	ZERORATE_HISTORIES=25000 cargo test --quiet --release --package zerorate-c --test histories
	$(MAKE) fuzz-core
	ZR_EVERY_ORDER=1 cargo test --quiet --package zerorate-core --no-default-features
	cargo run --quiet --package zerorate-core --no-default-features --profile test --example controller
	cargo test --quiet --package zerorate-benches --benches
	cargo publish --quiet --dry-run --package zerorate-core
	cargo clippy --quiet --package zerorate-bare -- -D warnings
	cargo rustc --quiet --package zerorate-bare --profile bare --crate-type staticlib
	cargo rustc --quiet $(BARE)
	ZR_LIBRARY=target/bare/libzerorate.a cargo test --quiet --package zerorate-c --test programs
	$(MAKE) fuzz MINUTES=10

BARE := --package zerorate-c --no-default-features --profile bare --crate-type staticlib

# Needs rustup's target, gcc-arm-none-eabi, libnewlib-arm-none-eabi and qemu-system-arm.
board: | check-cargo ## Compare a Cortex-M4F in QEMU with this machine, to the bit; count its instructions
	cargo rustc --quiet $(BARE)
	cargo rustc --quiet $(BARE) --target thumbv7em-none-eabihf
	rust/c/board/run.sh target/thumbv7em-none-eabihf/bare/libzerorate.a target/bare/libzerorate.a
	cargo rustc --quiet --package zerorate-board --no-default-features --profile bare \
		--crate-type staticlib --target thumbv7em-none-eabihf
	rust/c/board/count.sh target/thumbv7em-none-eabihf/bare/libzerorate_board.a

MINUTES ?= 60

fuzz: $(TOOLS) ## Search for faults for MINUTES (60), with a seed of its own
	FUZZ_SEED=$${FUZZ_SEED:-$$(date +%s)} FUZZ_MINUTES=$(MINUTES) \
		$(BIN)/python -m pytest tests/fuzz --numprocesses=logical

CASES ?= 1000000

# Nothing is compiled anew after the tests of the core in `nightly`.
fuzz-core: | check-cargo ## Try CASES (1000000) damaged inputs on each reader of bytes in the core
	PROPTEST_CASES=$(CASES) ZR_EVERY_ORDER=1 \
		cargo test --quiet --release --package zerorate-core any_bytes

lint: lint-core lint-package ## Check format, lints, types and stubs

lint-core: | check-cargo
	cargo fmt --all --check
	cargo clippy $(WORKSPACE) --all-targets -- -D warnings

PROSE := README.md CONTRIBUTING.md CHANGELOG.md Makefile .ci docs examples python rust tests benches

lint-package: $(TOOLS)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/codespell $(PROSE)
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest zerorate._native

docs: $(TOOLS) ## Build the documentation site into target/docs, warnings as errors
	@echo "1/2 installing what builds the site"
	$(INSTALL) --group docs
	@echo "2/2 building: notebooks run and figures are drawn, some minutes the first time"
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -d target/doctrees docs target/docs
	@echo "done: open target/docs/index.html"

links: $(TOOLS) ## Ask other hosts whether the pages that docs/ links are there
	$(INSTALL) --group docs
	$(BIN)/python -m sphinx --quiet -b linkcheck -d target/doctrees docs target/links

bench: $(TOOLS) ## Time filters and deviations against C and other packages
	$(INSTALL) --group bench
	$(INSTALL) --no-deps --target target/filterpy2 --upgrade 'filterpy>=2'
	cargo bench --package zerorate-benches --bench attitude --bench filters --bench streaming --bench allan
	$(BIN)/python -m pytest benches --benchmark-only

ratchet: | check-python check-cargo check-valgrind ## Count the instructions of hot paths; more than benches/instructions.csv says fails
	$(PYTHON) benches/ratchet.py

ratchet-renew: | check-python check-cargo check-valgrind ## Write benches/instructions.csv anew, where more is meant
	$(PYTHON) benches/ratchet.py --renew

results: $(TOOLS) ## Rebuild the tables and figures of docs/ from recordings and simulations
	$(BIN)/python examples/published_tables.py
	$(BIN)/python examples/process_noise_sweep.py
	$(BIN)/python examples/tuned_process_noise.py
	$(BIN)/python examples/offline_models.py
	$(BIN)/python examples/allan_figures.py
	$(BIN)/python examples/identify_figures.py
	$(BIN)/python examples/self_tuning.py
	$(BIN)/python examples/robust_figures.py
	$(BIN)/python examples/wavelet_figures.py
	$(BIN)/python examples/calibration_study.py
	$(BIN)/python examples/temperature_study.py
	$(BIN)/python examples/magnetometer_study.py
	$(BIN)/python examples/attitude_study.py
	$(BIN)/python examples/attitude_methods.py
	$(BIN)/python examples/attitude_figures.py
	$(BIN)/python examples/array_figures.py
	$(BIN)/python examples/navigation_tables.py
	$(BIN)/python examples/navigation_studies.py
	$(BIN)/python examples/navigation_vehicles.py
	$(BIN)/python examples/clock_scenarios.py
	$(BIN)/python examples/navigation_scenarios.py
	$(BIN)/python examples/compass_study.py
	$(BIN)/python examples/navigation_figures.py
	$(BIN)/python examples/foot_study.py
	$(BIN)/python examples/foot_machine.py
	$(BIN)/python examples/rest_accel.py
	$(BIN)/python examples/readme_numbers.py

compare: $(STAMP) ## Compare all methods on simulated gyros and on the recordings in RECORDINGS
	$(BIN)/zerorate compare --simulated --rate 100 $(RECORDINGS)/adis16405_static_100hz_run1.parquet
	$(BIN)/zerorate compare --rate 100 $(RECORDINGS)/mpu6050_static_100hz.parquet
	$(BIN)/zerorate compare $(RECORDINGS)/mpu6050_encoder_yaw_slow_100hz.parquet \
		--columns fixed_gyro_x_dps,fixed_gyro_y_dps,fixed_gyro_z_dps
	$(BIN)/zerorate compare $(RECORDINGS)/mpu6050_encoder_yaw_slow_100hz.parquet \
		--reference encoder_deg --columns shaft_gyro_z_dps
	$(BIN)/zerorate compare --rate 285.7142857 \
		$(RECORDINGS)/broad_05_undisturbed_slow_rotation_with_breaks_B.parquet
	$(BIN)/python examples/self_tuning.py $(RECORDINGS)

clean: ## Remove what was built
	rm -rf target $(VENV) demo

$(STAMP): $(SOURCES) | check-python check-cargo
	@test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	$(if $(UV),,$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1')
	$(INSTALL) $(PACKAGE)
	@touch $@

# What tests and lints need on top of the package.
$(TOOLS): pyproject.toml $(STAMP)
	$(INSTALL) --group test --group lint
	@touch $@

check-python:
	@command -v $(PYTHON) >/dev/null || { echo "zerorate needs Python 3.11 or later; no $(PYTHON) found" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "zerorate needs Python 3.11 or later; $(PYTHON) is $$($(PYTHON) -V)" >&2; exit 1; }

check-cargo:
	@command -v cargo >/dev/null || { echo "zerorate needs Rust 1.89 or later: no cargo found" >&2; exit 1; }
	@cargo -V | awk '{ split($$2, v, "."); exit !(v[1] > 1 || v[2] >= 89) }' || \
		{ echo "zerorate needs Rust 1.89 or later; found $$(cargo -V)" >&2; exit 1; }

check-valgrind:
	@command -v valgrind >/dev/null || { echo "counting instructions needs valgrind (apt install valgrind)" >&2; exit 1; }
