#!/usr/bin/env bash
# Fails when a source file is not as .clang-format says; prints the command that mends it.
set -euo pipefail
clang_format=$1
cd "$2"
mapfile -t files < <(find protocol firmware host estimator tools tests -name '*.cpp' -o -name '*.hpp' -o -name '*.inc')
if ! "$clang_format" --dry-run --Werror "${files[@]}"; then
  echo "To mend:  $(basename "$clang_format") -i \$(git ls-files '*.cpp' '*.hpp' '*.inc')"
  exit 1
fi
echo "${#files[@]} files are formatted"
