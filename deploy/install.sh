#!/usr/bin/env bash
# Installs the packages of deploy/packages.txt that are missing. Asks for nothing; needs apt only when one is missing.
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")

missing=()
while read -r package; do
  [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
done < <(sed 's/#.*//; /^[[:space:]]*$/d' "$here/packages.txt")
[[ ${#missing[@]} -eq 0 ]] && exit 0

if ! command -v apt-get >/dev/null; then
  echo "deploy/install.sh: no apt-get on this machine. bedflow is built with the packages of Debian 12;" >&2
  echo "install what these are called here, or use a Debian 12 container: ${missing[*]}" >&2
  exit 1
fi
as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "deploy/install.sh: packages are missing and there is no sudo. As root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "installing ${#missing[@]} packages: ${missing[*]}"
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y "$@" </dev/null; }
if ! apt install --no-install-recommends "${missing[@]}"; then
  apt update  # the lists may be missing, or too old
  apt install --no-install-recommends "${missing[@]}"
fi
