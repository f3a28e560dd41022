#!/usr/bin/env bash
# Makes the Debian package, unpacks it as a root of its own, and holds what lies there against what a machine
# needs: package.sh SOURCE_DIR BUILD_DIR
# Exit code 77 if all was well, but this machine lacks a program that judges the package (tools/setup installs them).
set -euo pipefail
source_dir=$1 build_dir=$2
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
fail() { echo "FAILED: $*" >&2; exit 1; }
skipped=()

(cd "$place" && cpack --config "$build_dir/CPackConfig.cmake" -B "$place" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >cpack.log 2>&1) ||
  { cat "$place/cpack.log"; fail "cpack"; }
package=$(ls "$place"/diastole_*.deb)
dpkg-deb -x "$package" "$place/root"
dpkg-deb -e "$package" "$place/control"
python_package=$(ls "$place"/python3-diastole_*_all.deb) || fail "there is no package python3-diastole"
dpkg-deb -x "$python_package" "$place/python"

for file in usr/bin/diastole usr/bin/sim_rig etc/diastole/rig.toml usr/lib/systemd/system/diastole-daemon.service \
  usr/lib/udev/rules.d/60-diastole.rules usr/lib/sysusers.d/diastole.conf usr/share/man/man1/diastole.1.gz \
  usr/share/doc/diastole/README.md usr/share/doc/diastole/copyright usr/share/doc/diastole/docs/run-file.md \
  usr/share/doc/diastole/diastole.cdx.json usr/share/doc/diastole/examples/gel.experiment.toml; do
  [[ -s $place/root/$file ]] || fail "the package lacks /$file"
done
if ls "$source_dir"/build/firmware/bin/*.bin >/dev/null 2>&1; then
  cmp "$source_dir/build/firmware/bin/diastole-stm32f405.bin" \
    "$place/root/usr/share/diastole/firmware/diastole-stm32f405.bin" || fail "the firmware image is not the one built"
else
  echo "no firmware image was built: the package carries none (cmake --build --preset firmware)"
fi
grep -qx /etc/diastole/rig.toml "$place/control/conffiles" || fail "the rig file is no conffile"

# Every command has its manual page, and bash completes it.
"$place/root/usr/bin/diastole" --help |
  awk '/^Subcommands:/ {inside = 1; next} /^[^ ]/ {inside = 0} inside && /^  [^ ]/ {print $1}' >"$place/commands"
completed=$(PATH="$place/root/usr/bin:$PATH" bash -c "source '$place/root/usr/share/bash-completion/completions/diastole'
  COMP_WORDS=(diastole '') COMP_CWORD=1 && _diastole diastole && printf '%s\n' \"\${COMPREPLY[@]}\"")
while read -r command; do
  [[ -s $place/root/usr/share/man/man1/diastole-$command.1.gz ]] || fail "there is no manual page diastole-$command"
  grep -qx -- "$command" <<<"$completed" || fail "bash does not complete $command"
done <"$place/commands"
[[ $(wc -l <"$place/commands") -gt 30 ]] || fail "diastole --help lists too few commands"

# The Python package finds the installed program.
read_back="import diastole; print(diastole.results.Fit.__name__, diastole.call('effects')['effects'][0]['id'])"
DIASTOLE=$place/root/usr/bin/diastole PYTHONPATH=$place/python/usr/lib/python3/dist-packages \
  /usr/bin/python3 -B -c "$read_back" || fail "the Python package cannot be used"

# The installed program, on the installed files.
diastole=$place/root/usr/bin/diastole
"$diastole" --help >/dev/null
"$diastole" simulate "$place/root/usr/share/doc/diastole/examples/gel.experiment.toml" -o "$place/gel.run.h5" --json \
  >"$place/gel.json" 2>"$place/gel.log" || { cat "$place/gel.log"; fail "the installed program cannot simulate"; }
said=$("$diastole" daemon --config "$place/root/etc/diastole/rig.toml" --journal-dir "$place/journals" 2>&1) && code=0 || code=$?
if getent group diastole >/dev/null; then expected=3; else expected=2; fi # no controller; or first: no such group
[[ $code == "$expected" ]] || fail "with the installed rig file the daemon ended with $code: $said"

# The unit, as systemd reads it.
if command -v systemd-analyze >/dev/null; then
  mkdir -p "$place/root/etc" && printf 'root:x:0:0::/:/bin/sh\ndiastole:x:999:999::/:/bin/false\n' >"$place/root/etc/passwd"
  printf 'root:x:0:\ndiastole:x:999:\ndiastole-devices:x:998:diastole\n' >"$place/root/etc/group"
  for unit in sysinit.target basic.target network.target shutdown.target multi-user.target system.slice; do
    printf '[Unit]\nDescription=stand-in\n' >"$place/root/usr/lib/systemd/system/$unit"
  done
  verdict=$(systemd-analyze verify --man=no --root="$place/root" diastole-daemon.service 2>&1 || true)
  ! grep -q 'diastole-daemon.service' <<<"$verdict" || fail "systemd-analyze verify: $verdict"
  systemd-analyze security --offline=true --threshold=20 --no-pager \
    --root="$place/root" diastole-daemon.service >"$place/security.log" 2>&1 ||
    { cat "$place/security.log"; fail "the service is more exposed than 2.0"; }
  grep -a 'Overall exposure' "$place/security.log" || true
else
  skipped+=("the service's unit and its exposure: there is no systemd-analyze")
fi
# Each rule has what it matches and what it gives.
grep -vE '^(#|$)' "$place/root/usr/lib/udev/rules.d/60-diastole.rules" |
  grep -vE '^SUBSYSTEM=="[a-z]+", ([A-Z]+(\{[A-Za-z]+\})?=="[^"]+", )+GROUP="diastole-devices", MODE="0660"$' &&
  fail "a udev rule has another form"
grep -vE '^(#|$)' "$place/root/usr/lib/udev/rules.d/60-diastole.rules" | grep -E 'SUBSYSTEM=="(tty|gpio)"' &&
  fail "a udev rule gives away serial adapters or GPIO chips of any kind"

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error "$package" || fail "lintian"
else
  skipped+=("Debian's rules for packages: there is no lintian")
fi
echo "$(basename "$package"): $(stat -c %s "$package") bytes, $(dpkg-deb -c "$package" | wc -l) entries"
if [[ ${#skipped[@]} -gt 0 ]]; then
  printf 'skipped: %s; install what tools/packages.txt lists\n' "${skipped[@]}" >&2
  exit 77
fi
