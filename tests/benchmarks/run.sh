#!/usr/bin/env bash
# One table of what mbcosim costs: see run.py.
exec python3 "$(dirname "$0")/run.py" "$@"
