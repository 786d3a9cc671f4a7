#!/usr/bin/env bash
# Installs the Debian packages of dependencies.txt that are missing. Usage: install-dependencies.sh [build|page|run|start|all|fuzz]
#   build  what compiles the program                   page   build, and what builds the daemon's page
#   run    what a container needs to run the daemon    start  what the quick start needs: no page
#   all    what builds, tests and shows (default)      fuzz   what builds the fuzz target
set -euo pipefail
list=$(dirname "$(realpath "$0")")/dependencies.txt
what=${1:-all}

case $what in
  build) wanted='$2 == ""' ;;
  run) wanted='$2 == "run"' ;;
  page) wanted='$2 == "" || $2 == "page"' ;;
  start) wanted='$2 == "" || $2 == "start"' ;;
  all) wanted='$2 != "run" && $2 != "fuzz"' ;;
  fuzz) wanted='$2 == "" || $2 == "fuzz"' ;;
  *) echo "usage: $0 [build|page|run|start|all|fuzz]" >&2; exit 4 ;;
esac
packages=()
names=$(sed 's/#.*//' "$list" | awk "NF && $wanted {print \$1}")
[ -z "$names" ] || mapfile -t packages <<<"$names"
[ ${#packages[@]} -gt 0 ] || { echo "$list names no package" >&2; exit 4; }

missing=()
for package in "${packages[@]}"; do
  case $package in  # Debian's conflict with other builds of Node
    nodejs | npm) command -v npm >/dev/null && continue ;;
  esac
  state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$state" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "these packages are missing, and there is no sudo: ${missing[*]}" >&2; exit 4; }
  as_root=(sudo)
fi
echo "installing: ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
