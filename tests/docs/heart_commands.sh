#!/usr/bin/env bash
# Runs what the documents show of images and hearts, their ```console blocks, on the heart that examples/heart/make makes: the lines
# `$ diastole ...`, each document's in their order in a folder of its own. Each must exit with 0. Not the desk, which waits for a person.
#   heart_commands.sh SOURCE_FOLDER BIN_FOLDER DOCUMENT.md...
set -euo pipefail
source_dir=$1 bin_dir=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PATH="$bin_dir:$PATH" XDG_CACHE_HOME="$work/cache"
"$source_dir/examples/heart/make" "$work/made"
# What a person may have changed, and a volume in the run, are not replaced.
rm "$work"/made/heart.guide.csv "$work"/made/*.html
/usr/bin/python3 -c 'import h5py, sys; del h5py.File(sys.argv[1], "r+")["mr/flow"]' "$work/made/heart.run.h5"
for document in "$@"; do
  folder=$work/$(basename "$document" .md)
  cp -r "$work/made" "$folder"
  cd "$folder"
  mapfile -t commands < <(awk '/^```console/{inside=1; next} /^```/{inside=0} inside && /^\$ diastole / && !/^\$ diastole desk/{sub(/^\$ /, ""); sub(/ +#.*/, ""); print}' "$source_dir/$document")
  [[ ${#commands[@]} -gt 0 ]] || { echo "$document holds no command" >&2; exit 1; }
  for command in "${commands[@]}"; do
    echo "\$ $command"
    bash -c "$command" </dev/null
  done
  echo "${#commands[@]} commands of $document ran"
done
