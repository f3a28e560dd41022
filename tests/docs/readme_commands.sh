#!/usr/bin/env bash
# Runs every `diastole ...` line of README.md's ```sh blocks, in their order, in an empty folder that sees
# examples/, as a newcomer would. Each must exit with 0.
set -euo pipefail
source_dir=$1 bin_dir=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ln -s "$source_dir/examples" "$work/examples"
cd "$work"
export PATH="$bin_dir:$PATH"

count=0
while IFS= read -r command; do
  echo "\$ $command"
  bash -c "$command"
  count=$((count + 1))
done < <(awk '/^```sh/{inside=1; next} /^```/{inside=0} inside && /^diastole /{sub(/ +#.*/, ""); print}' "$source_dir/README.md")

[[ $count -gt 0 ]] || { echo "README.md holds no diastole command" >&2; exit 1; }
echo "$count commands of README.md ran"
