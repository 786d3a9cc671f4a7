#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test. Works on Debian 12 as root or with sudo.
#
# usage: tests/run.sh [--asan | --tsan | --fuzz] [--hostile [SECONDS] | --soak [MINUTES]] [--quick] [ctest arguments …]
#        tests/run.sh --tidy [REVISION | --all]
#   --asan   address and undefined-behaviour sanitizers, in build-asan/
#   --tsan   thread sanitizer, in build-tsan/
#   --fuzz   fuzzes the deck reader for 60 seconds (clang), in build-fuzz/; no other test
#   --hostile  hostile clients against the daemon for SECONDS (default: 300); no other test
#   --soak   a daemon in long use (default: 10^6 steps), then one that is killed again and again (default: 1000 times), each for
#            MINUTES; no other test
#   --quick  skips the tests labelled `slow`
#   --tidy   clang-tidy on the sources changed since REVISION (default: the commit before the last), instead of the tests
set -euo pipefail
here=$(realpath "$0")
cd "$(dirname "$here")/.."

preset=release
arguments=()
tidy=
hostile=
soak=
while [ $# -gt 0 ]; do
  case $1 in
    --asan) preset=asan ;;
    --tsan) preset=tsan ;;
    --fuzz) exec tests/fuzz/run.sh 60 ;;
    --hostile)
      hostile=300
      [[ ${2:-} =~ ^[0-9]+$ ]] && hostile=$2 && shift
      ;;
    --soak)
      soak=yes minutes=()
      [[ ${2:-} =~ ^[0-9]+$ ]] && minutes=(--minutes "$2") && shift
      ;;
    --quick) arguments+=(--label-exclude slow) ;;
    --tidy) tidy=yes ;;
    -h | --help) sed -n '2,13s/^# \{0,1\}//p' "$here"; exit 0 ;;
    *) arguments+=("$1") ;;
  esac
  shift
done
folder=build
[ $preset = release ] || folder=build-$preset
jobs=$(nproc)

docker/install-dependencies.sh all
groups=ON
[ -z $tidy ] || groups=OFF  # clang-tidy asks how each source is compiled
cmake --preset $preset -DMBCOSIM_SERVER=ON -DMBCOSIM_TESTS=ON -DMBCOSIM_UNITY=$groups  # also where a build without them stands
cmake --build $folder --parallel "$jobs"
[ -z $tidy ] || exec tests/repository/tidy.py . $folder "${arguments[@]}"
case $preset in  # what bounds on time are multiplied by
  asan) export MBCOSIM_TIME_FACTOR=5 ;;
  tsan) export MBCOSIM_TIME_FACTOR=20 ;;
esac
# Reports that are suppressed must not be kept to be compared with later ones: in a list that grows, that takes seconds.
export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp history_size=7 suppress_equal_addresses=0 suppress_equal_stacks=0 ${TSAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1 halt_on_error=1 ${UBSAN_OPTIONS:-}"
export ASAN_OPTIONS="detect_leaks=1 ${ASAN_OPTIONS:-}" LSAN_OPTIONS="suppressions=$PWD/tests/lsan.supp ${LSAN_OPTIONS:-}"
[ -z "$hostile$soak" ] || export MBCOSIM_BIN=$PWD/$folder/bin PYTHONPATH=$PWD/$folder/python PYTHONDONTWRITEBYTECODE=1
if [ -n "$hostile" ]; then
  [ $preset = release ] || arguments+=(--sanitized)
  exec /usr/bin/python3 tests/hostile/hostile.py $folder/bin --seconds "$hostile" --seed "$(date +%s)" "${arguments[@]}"
fi
if [ -n "$soak" ]; then
  sanitized=()
  [ $preset = release ] || sanitized=(--sanitized)
  /usr/bin/python3 tests/soak/soak.py "${minutes[@]}" "${sanitized[@]}" --seed "$(date +%s)"
  exec /usr/bin/python3 tests/soak/kills.py "${minutes[@]}" --seed "$(date +%s)"
fi
at_once=$(((3 * jobs + 1) / 2))  # tests of the service wait most of the time
[ $preset = release ] || at_once=$jobs
exec ctest --test-dir $folder --output-on-failure --parallel "$at_once" "${arguments[@]}"
