#!/usr/bin/env bash
# Builds release and prints every figure the project claims, a line each: name, value, unit, target, met or short, change against
# the recorded baseline, and what stands beside it. --record keeps the figures as this machine's baseline.
# usage: deploy/bench.sh [--record] [dem|gas|transfer|bed|presets|peers|scaling|trade|service]...
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

deploy/install.sh >&2
deploy/build.sh release >&2
exec python3 tests/performance/figures.py build/release/bin "$@"
