# shellcheck shell=bash
# shellcheck disable=SC2034  # used by those that source this
# Sourced by the scripts of this folder: steps with a log each, a clear end when one fails.
set -u -o pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=ci/$(basename "$0")
jobs=$(nproc)
logs=$root/build/logs
declare -a finished=()
on_failure=   # a command that a failing shown_step runs first
cd "$root" || exit 1
mkdir -p "$logs"

die() {
  printf '\n%s: %s\n' "$program" "$1" >&2
  exit 1
}

# Seconds as 3:07.
as_minutes() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }

# The last "[12/345]" of ninja or "12/345 Test" of ctest in a log.
progress_of() { tail -n 20 "$1" | tr '\r' '\n' | grep -oE '^ *\[?[0-9]+/[0-9]+\]?' | tail -n 1 | tr -d ' []'; }

# Shows the progress of process $1 with log $2 until it ends: one line that changes on a terminal,
# a line each 20 s elsewhere.
watch_progress() {
  local pid=$1 log=$2 seconds=0 shown='' now
  while kill -0 "$pid" 2>/dev/null; do
    sleep 0.5
    seconds=$((seconds + 1))
    now=$(progress_of "$log")
    if [ -z "$now" ] || [ "$now" = "$shown" ]; then continue; fi
    if [ -t 1 ]; then
      printf '\r     %-20s' "$now"
    elif [ $((seconds % 40)) = 0 ]; then
      printf '     %s\n' "$now"
    else
      continue
    fi
    shown=$now
  done
  [ -t 1 ] && printf '\r%26s\r' ''
}

# step TITLE COMMAND...: runs it with its output in a log; the first failure ends the script.
step() {
  local title=$1 log start
  shift
  log=$logs/$(printf '%s' "$title" | tr -cs 'a-zA-Z0-9+\n' '_').log
  printf -- '-- %s\n' "$title"
  start=$SECONDS
  set -m   # a process group of its own, so that an interrupt ends all of it
  "$@" >"$log" 2>&1 </dev/null &
  local pid=$!
  set +m
  trap 'kill -- -"$pid" 2>/dev/null; exit 130' INT TERM
  watch_progress $pid "$log"
  wait $pid || fail_step "$title" "$log" "$*"
  trap - INT TERM
  finished+=("$(as_minutes $((SECONDS - start)))  $title")
}

# Like step, for commands whose output is the result: it is shown as well.
shown_step() {
  local title=$1 log start
  shift
  log=$logs/$(printf '%s' "$title" | tr -cs 'a-zA-Z0-9+\n' '_').log
  printf -- '-- %s\n' "$title"
  start=$SECONDS
  "$@" </dev/null 2>&1 | tee "$log" || { ${on_failure-}; fail_step "$title" "$log" "$*" quiet; }
  finished+=("$(as_minutes $((SECONDS - start)))  $title")
}

fail_step() {
  local title=$1 log=$2 command=$3
  if [ "${4-}" != quiet ]; then
    # A parallel build goes on after its first error, so the cause is not at the end.
    { grep -m 3 -A 12 -E '^FAILED:|error:|CMake Error|^E: ' "$log" || tail -n 40 "$log"; } |
      cut -c -240 >&2
  fi
  die "step '$title' failed
  command: $command
  log:     $log"
}

summary() {
  printf '\n%s: passed in %s\n' "$program" "$(as_minutes $SECONDS)"
  printf '  %s\n' "${finished[@]}"
}

# ccache makes the second build short. It is used where it is installed, never required.
if command -v ccache >/dev/null; then
  export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS-pch_defines,time_macros}   # or precompiled headers defeat it
  export CMAKE_C_COMPILER_LAUNCHER=${CMAKE_C_COMPILER_LAUNCHER-ccache}
  export CMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER-ccache}
fi
