#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test. Works on Debian 12 as root or with sudo.
#
# usage: tests/run.sh [--asan | --tsan | --fuzz] [--quick] [ctest arguments …]
#   --asan   address and undefined-behaviour sanitizers, in build-asan/
#   --tsan   thread sanitizer, in build-tsan/
#   --fuzz   builds and runs the fuzz targets for a short while, in build-fuzz/ (clang)
#   --quick  skips the tests labelled `slow`
set -euo pipefail
cd "$(dirname "$0")/.."

preset=release
arguments=()
while [ $# -gt 0 ]; do
  case $1 in
    --asan) preset=asan ;;
    --tsan) preset=tsan ;;
    --fuzz) preset=fuzz ;;
    --quick) arguments+=(--label-exclude slow) ;;
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) arguments+=("$1") ;;
  esac
  shift
done
folder=build
[ $preset = release ] || folder=build-$preset
jobs=$(nproc)

docker/install-dependencies.sh all
if [ $preset = fuzz ]; then
  command -v clang++ >/dev/null || { echo "--fuzz needs clang++" >&2; exit 4; }
  cmake -S . -B build-fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang \
    -DMBCOSIM_FUZZ=ON -DMBCOSIM_SERVER=OFF -DMBCOSIM_BENCHMARKS=OFF
else
  cmake --preset $preset
fi
cmake --build $folder --parallel "$jobs"
export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp history_size=7 ${TSAN_OPTIONS:-}"
export ASAN_OPTIONS="detect_leaks=1 ${ASAN_OPTIONS:-}" LSAN_OPTIONS="suppressions=$PWD/tests/lsan.supp ${LSAN_OPTIONS:-}"
exec ctest --test-dir $folder --output-on-failure --parallel "$jobs" "${arguments[@]}"
