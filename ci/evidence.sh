# shellcheck shell=bash
# Sourced after common.sh: what a failed test leaves.

# leave_evidence NAME CTEST_ARGUMENT...: the failed tests of the last ctest with these arguments once
# more, now with their files, in build/evidence/NAME. Runs repeat bit for bit, so they fail as they did.
leave_evidence() {
  local name=$1 out log
  shift
  out=$root/build/evidence/$name
  log=$logs/evidence_$name.log
  rm -rf "$out"
  ORRERY_OUT=$out timeout 900 ctest "$@" --rerun-failed --timeout 300 >"$log" 2>&1 </dev/null
  if [ -e "$out/index.html" ]; then
    printf '\nthe failed tests and all that they recorded:\n  %s\n' "$out/index.html"
    # A hidden folder is that of a run which was killed.
    find "$out" -mindepth 2 -maxdepth 2 -type d \( -name 'seed-*' -o -name '.seed-*' \) | sort |
      sed 's/^/  /' | head -n 20
  else
    printf '\nthe failed tests ran no world that records; what they printed: %s\n' "$log"
  fi
} >&2
