#!/bin/sh
# Installs what builds the page, as the lock file has it. usage: install.sh NPM
set -eu
cd "$(dirname "$0")"
"$1" ci --no-audit --no-fund --loglevel=error >&2 || {
  echo "the page's packages cannot be installed; to build the daemon without its page: cmake --preset release -DMBCOSIM_PAGE=OFF" >&2
  exit 1
}
