#!/usr/bin/env bash
# Builds the fuzz targets with clang and libFuzzer, and runs each for so many seconds from the inputs in tests/fuzz/corpus.
# usage: deploy/fuzz.sh [seconds, 60 if absent]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || { echo "usage: deploy/fuzz.sh [seconds]" >&2; exit 2; }
cmake --preset fuzz -DBEDFLOW_FUZZ_SECONDS="$seconds" >/dev/null
cmake --build --preset fuzz
ctest --preset fuzz --output-on-failure
