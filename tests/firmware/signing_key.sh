#!/usr/bin/env bash
# Where the firmware's build keeps the key that it signs with (firmware/boards/stm32f405/signing_key.cmake): outside of the build
# folder, wherever a person's folder is, and never another key in silence.
#   signing_key.sh SOURCE_FOLDER
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/ask.cmake" <<END
include($1/firmware/boards/stm32f405/signing_key.cmake)
diastole_signing_key(key)
END
mkdir "$work/build"
cd "$work/build"

choose() { # choose [NAME=VALUE ...] [-- CMAKE ARGUMENTS ...]: what is printed, in one line
  local variables=()
  while [[ $# -gt 0 && $1 != -- ]]; do variables+=("$1") && shift; done
  env -u HOME -u XDG_CONFIG_HOME "${variables[@]}" cmake "${@:2}" -P "$work/ask.cmake" 2>&1 | tr -s ' \n' ' '
}
expect() { # expect WHAT PRINTED: ends the test unless it is part of what was printed
  [[ $2 == *"$1"* ]] || { printf 'expected: %s\nprinted:  %s\n' "$1" "$2" >&2; exit 1; }
}
signed_with() { expect "Firmware is signed with the key $1" "$2"; }

signed_with "$work/home/.config/diastole/signing-key.pem" "$(choose HOME="$work/home")"
[[ $(stat -c %a "$work/home/.config/diastole") == 700 ]]
signed_with "$work/xdg/diastole/signing-key.pem" "$(choose HOME="$work/home" XDG_CONFIG_HOME="$work/xdg")"
signed_with "$work/home/.config/diastole/signing-key.pem" "$(choose HOME="$work/home" XDG_CONFIG_HOME=relative)"

for nowhere in UNSET=1 HOME=/dev/null; do # a service that builds has no home, or none that it may write to
  printed=$(choose "$nowhere")
  signed_with "$work/build/signing-key.pem" "$printed"
  expect "lost with the build folder" "$printed"
done

echo "the key of earlier builds" >signing-key.pem
chmod 600 signing-key.pem
printed=$(choose HOME="$work/later")
signed_with "$work/later/.config/diastole/signing-key.pem" "$printed"
cmp signing-key.pem "$work/later/.config/diastole/signing-key.pem"
[[ $(stat -c %a "$work/later/.config/diastole/signing-key.pem") == 600 && $printed != *Warning* ]]
echo "another" >"$work/later/.config/diastole/signing-key.pem"
expect "signed with another key, $work/build/signing-key.pem" "$(choose HOME="$work/later")"

signed_with "$work/given.pem" "$(choose HOME="$work/unused" -- -DDIASTOLE_SIGNING_KEY="$work/given.pem")"
expect "from anybody" "$(choose HOME="$work/unused" -- -DDIASTOLE_SIGNING_KEY=none)"
expect "the key file's whole path" "$(choose HOME="$work/unused" -- -DDIASTOLE_SIGNING_KEY=given.pem || true)"
[[ ! -e $work/unused ]]
