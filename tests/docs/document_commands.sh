#!/usr/bin/env bash
# Runs what a document shows, in its order, in an empty folder that sees examples/ and tests/data, as a newcomer would: of its ```sh blocks
# the lines that begin with `diastole`, `printf`, `mkdir` or `cp`. With PREPARED, a copy of that folder instead, and of its ```console
# blocks the lines `$ diastole ...` but for the desk, which waits for a person. Each must exit with 0.
#   document_commands.sh SOURCE_FOLDER BIN_FOLDER DOCUMENT.md [PREPARED]
set -euo pipefail
source_dir=$1 bin_dir=$2 document=$3 prepared=${4:-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
[[ -z $prepared ]] || cp -r "$prepared/." "$work"
mkdir "$work/tests"
ln -s "$source_dir/examples" "$work/examples"
ln -s "$source_dir/tests/data" "$work/tests/data"
cd "$work"
export PATH="$bin_dir:$PATH" XDG_CACHE_HOME="$work/cache"

block=sh shown='^(diastole|printf|mkdir|cp) '
[[ -z $prepared ]] || block=console shown='^[$] diastole '
count=0
while IFS= read -r command; do
  echo "\$ $command"
  bash -c "$command" </dev/null
  count=$((count + 1))
done < <(awk -v block="^\`\`\`$block" -v shown="$shown" '$0 ~ block {inside=1; next} /^```/{inside=0} inside && $0 ~ shown && !/diastole desk/ {sub(/^[$] /, ""); sub(/ +#.*/, ""); print}' "$source_dir/$document")

[[ $count -gt 0 ]] || { echo "$document holds no command" >&2; exit 1; }
echo "$count commands of $document ran"
