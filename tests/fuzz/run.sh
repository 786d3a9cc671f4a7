#!/usr/bin/env bash
# Fuzzes the deck reader: no crash, no sanitizer report, no input of at most 64 KiB that takes longer than a second.
#
# usage: tests/fuzz/run.sh [SECONDS [FOLDER_WITH_MORE_DECKS ...]]     (default 60 seconds)
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
shift || true

docker/install-dependencies.sh fuzz
cmake --preset fuzz
cmake --build --preset fuzz --parallel "${MBCOSIM_JOBS:-$(nproc)}"
python3 tests/fuzz/seeds.py build-fuzz/seeds "$@"
mkdir -p build-fuzz/corpus build-fuzz/findings
exec build-fuzz/bin/reader_fuzz -max_total_time="$seconds" -max_len=65536 -timeout=1 -rss_limit_mb=2048 -dict=build-fuzz/reader.dict \
  -artifact_prefix=build-fuzz/findings/ -print_final_stats=1 build-fuzz/corpus build-fuzz/seeds
