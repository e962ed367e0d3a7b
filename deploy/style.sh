#!/usr/bin/env bash
# Checks the layout of our sources with clang-format, and them with clang-tidy (.clang-format, .clang-tidy).
# A file that was clean is looked at again only when it, a header of ours that it includes, or the checks have changed.
# usage: deploy/style.sh [preset that was built]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build=build/${1:-release}
mapfile -t files < <(git ls-files --cached --others --exclude-standard '*.h' '*.cpp')
clang-format --dry-run --Werror "${files[@]}"
python3 tests/support/tidy.py "$build"
echo "style: ${#files[@]} files are clean"
