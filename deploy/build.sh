#!/usr/bin/env bash
# Builds bedflow into build/PRESET (see CMakePresets.json).
# usage: deploy/build.sh [release|dev|audit|asan] [targets]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${1:-release}
shift $(($# > 0))
cmake --preset "$preset" -Wno-dev >/dev/null
cmake --build --preset "$preset" ${1:+--target "$@"}
