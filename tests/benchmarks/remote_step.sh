#!/usr/bin/env bash
# Cost of one remote step: starts the daemon on the loopback interface and runs the benchmark against it.
# usage: tests/benchmarks/remote_step.sh [BUILD FOLDER] [Google Benchmark options]
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:-build}
[ $# -gt 0 ] && shift
port=$((20000 + RANDOM % 20000))
"$build/bin/mbcosimd" --listen "127.0.0.1:$port" --insecure --log-level warn &
daemon=$!
trap 'kill $daemon; wait $daemon || true' EXIT
for _ in $(seq 100); do
  "$build/bin/mbcosimd" --check "127.0.0.1:$port" >/dev/null 2>&1 && break
  sleep 0.05
done
"$build/bin/remote_step" "127.0.0.1:$port" "$@"
