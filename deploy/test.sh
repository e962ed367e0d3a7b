#!/usr/bin/env bash
# Installs what is missing, builds, checks the style and runs the tests.
# usage: deploy/test.sh [release|dev|audit|asan] [arguments of ctest]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=release
if [[ $# -gt 0 && $1 != -* ]]; then
  preset=$1
  shift
fi
deploy/install.sh
deploy/build.sh "$preset"
style=clean
deploy/style.sh "$preset" || style="not clean"
ctest --preset "$preset" --parallel "$(nproc)" "$@" </dev/null
if [[ $style != clean ]]; then
  echo "the tests passed, but the style is $style: see above, before the tests" >&2
  exit 1
fi
