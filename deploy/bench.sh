#!/usr/bin/env bash
# Builds release and prints every figure the project claims, a line each: name, value, unit, target, met or short.
# usage: deploy/bench.sh [dem|gas|bed]...
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

deploy/install.sh >&2
deploy/build.sh release >&2
exec python3 tests/performance/figures.py build/release/bin "$@"
