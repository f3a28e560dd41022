#!/usr/bin/env bash
# Runs what documents show of images and hearts (document_commands.sh) on the heart that examples/heart/make makes.
#   heart_commands.sh SOURCE_FOLDER BIN_FOLDER DOCUMENT.md...
set -euo pipefail
source_dir=$1 bin_dir=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PATH="$bin_dir:$PATH"
"$source_dir/examples/heart/make" --unmeasured "$work/made"
(cd "$work/made" && diastole lv dicom -o heart.mesh --mesh 8,4,2) # with which fibres.md begins
for document in "$@"; do
  "$source_dir/tests/docs/document_commands.sh" "$source_dir" "$bin_dir" "$document" "$work/made"
done
