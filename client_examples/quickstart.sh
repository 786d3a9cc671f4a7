#!/usr/bin/env bash
# Installs what is missing, builds, starts the server, and runs the first example. Works on Debian 12 as root or with sudo.
set -euo pipefail
cd "$(dirname "$0")/.."

docker/install-dependencies.sh start
cmake --preset release >/dev/null
cmake --build build --parallel "$(nproc)" --target mbcosim mbcosimd mbcosim_python

work=$(mktemp -d)
[ "$(printf %s "$work" | wc -c)" -le 80 ] || { rmdir "$work"; work=$(mktemp -d -p /tmp); }  # the path of a socket has at most 107 bytes
address=unix:$work/mbcosim.sock
build/bin/mbcosimd --listen "$address" --log-level warn &
daemon=$!
trap 'kill "$daemon" 2>/dev/null || true; wait "$daemon" 2>/dev/null || true; rm -rf "$work"' EXIT
mkdir -p out
PYTHONPATH=build/python /usr/bin/python3 client_examples/python/tumbling_body.py --address "$address" --plot out/tumbling.png
