#!/usr/bin/env bash
# Runs what documents show of images and hearts (document_commands.sh) on the heart that examples/heart/make makes.
#   heart_commands.sh SOURCE_FOLDER BIN_FOLDER DOCUMENT.md...
set -euo pipefail
source_dir=$1 bin_dir=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH="$bin_dir:$PATH" "$source_dir/examples/heart/make" "$work/made"
# What a person may have changed, and a volume in the run, are not replaced.
rm "$work"/made/heart.guide.csv "$work"/made/*.html
/usr/bin/python3 -c 'import h5py, sys; del h5py.File(sys.argv[1], "r+")["mr/flow"]' "$work/made/heart.run.h5"
for document in "$@"; do
  "$source_dir/tests/docs/document_commands.sh" "$source_dir" "$bin_dir" "$document" "$work/made"
done
