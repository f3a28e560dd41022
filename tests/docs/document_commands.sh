#!/usr/bin/env bash
# Runs what a document's ```sh blocks show, in their order, in an empty folder that sees examples/ and tests/data, as a
# newcomer would: the lines that begin with `diastole`, `printf`, `mkdir` or `cp`. Each must exit with 0.
#   document_commands.sh SOURCE_FOLDER BIN_FOLDER DOCUMENT.md
set -euo pipefail
source_dir=$1 bin_dir=$2 document=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/tests"
ln -s "$source_dir/examples" "$work/examples"
ln -s "$source_dir/tests/data" "$work/tests/data"
cd "$work"
export PATH="$bin_dir:$PATH" XDG_CACHE_HOME="$work/cache"

count=0
while IFS= read -r command; do
  echo "\$ $command"
  bash -c "$command"
  count=$((count + 1))
done < <(awk '/^```sh/{inside=1; next} /^```/{inside=0} inside && /^(diastole|printf|mkdir|cp) /{sub(/ +#.*/, ""); print}' "$source_dir/$document")

[[ $count -gt 0 ]] || { echo "$document holds no command" >&2; exit 1; }
echo "$count commands of $document ran"
