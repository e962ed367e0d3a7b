#!/usr/bin/env bash
# Checks what operators are given: the service unit, its configuration, the container, the Kubernetes files and these scripts, each with
# what this machine has; says what it could not check.
# usage: deploy/check.sh [folder of the built programs] [--build-container]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

programs=$PWD/build/release/bin
build_container=no
for word in "$@"; do
  if [[ $word == --build-container ]]; then build_container=yes; else programs=$(realpath "$word"); fi
done
scratch=$(mktemp -d)
server=
finish() {
  if [[ -n $server ]]; then
    kill "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
  fi
  rm -rf "$scratch"
}
trap finish EXIT

has() { command -v "$1" >/dev/null; }
left_out() { echo "not checked: $*"; }
fail() {
  echo "deploy/check.sh: $*" >&2
  exit 1
}

check_unit() {
  if ! has systemd-analyze; then
    left_out "the service unit: there is no systemd-analyze"
    return
  fi
  local unit=$scratch/bedflowd.service said
  sed "s|/usr/bin/bedflowd|$programs/bedflowd|; /^Documentation=/d" deploy/systemd/bedflowd.service >"$unit"
  said=$(systemd-analyze verify --man=no "$unit" 2>&1 | grep -F bedflowd.service || true)  # of other units it may say what it likes
  [[ -z $said ]] || fail "systemd-analyze verify: $said"
  # 0 is no exposure, 100 all of it. What is left is what engines need: the network of this machine and its processors' clocks.
  systemd-analyze security --offline=yes --threshold=20 --no-pager "$unit" >"$scratch/security" || {
    cat "$scratch/security" >&2
    fail "the unit is more exposed than it was"
  }
  echo "systemd: verified; $(tail -n 1 "$scratch/security" | sed 's/^[^O]*//')"
}

# The example configuration, but for the places: the server takes every option of it, and answers.
check_configuration() {
  sed "s|/var/lib/bedflow|$scratch/data|; s|/run/bedflow|$scratch/data|; s|127.0.0.1:9464|127.0.0.1:0|" deploy/systemd/bedflowd.conf \
    >"$scratch/bedflowd.conf"
  sed -n 's/^# \([a-z-]* = \)/\1/p' deploy/systemd/bedflowd.conf >>"$scratch/bedflowd.conf"  # what is commented out too
  "$programs/bedflowd" --config "$scratch/bedflowd.conf" >"$scratch/out" 2>"$scratch/log" &
  server=$!
  for _ in $(seq 200); do
    grep -q listening "$scratch/out" && break
    kill -0 "$server" 2>/dev/null || fail "bedflowd does not take its example configuration: $(cat "$scratch/log")"
    sleep 0.05
  done
  "$programs/bedflow" server usage --server "unix:$scratch/data/bedflowd.sock" >"$scratch/usage" || fail "bedflowd does not answer"
  grep -q 'reserve 10.0 GiB' "$scratch/usage" || fail "the reserve of the configuration is not in force: $(cat "$scratch/usage")"
  echo "configuration: every option is taken, and the server answers"
}

check_container() {
  local package
  if has apt-cache && apt-cache pkgnames | sort >"$scratch/known" && grep -qx bash "$scratch/known"; then
    # The words behind each "apt-get install" of the file.
    sed -e ':join' -e '/\\$/{N;s/\\\n//;bjoin}' deploy/container/Containerfile | grep -o 'install -y [^&]*' | tr ' ' '\n' |
      grep -vx -e install -e '-y' -e '--no-install-recommends' -e '' >"$scratch/packages"
    while read -r package; do
      grep -qxF -- "$package" "$scratch/known" || fail "Containerfile: Debian has no package $package"
    done <"$scratch/packages"
    echo "container: Debian has its $(wc -l <"$scratch/packages") packages"
  else
    left_out "the container's packages: there are no package lists"
  fi
  # What the programs need besides must come with the second stage's packages.
  if has dpkg-query; then
    local library file runtime
    runtime=$(sed '1,/^FROM.*debian:12$/d' deploy/container/Containerfile)
    while read -r library; do
      file=$(realpath "$library")
      package=$(dpkg-query -S "$file" 2>/dev/null | head -n 1 | cut -d: -f1 || true)
      case $package in
        libgrpc++1.51 | libprotobuf32 | libspdlog1.10 | libsqlite3-0 | libisal2 | libhdf5-openmpi-103-1)
          grep -q -F -- "$package" <<<"$runtime" || fail "Containerfile: the programs need $package, and it is not installed"
          ;;
      esac
    done < <(ldd "$programs"/bedflow "$programs"/bedflowd "$programs"/bedflow-engine "$programs"/bedflow-reader |
      sed -n 's/.*=> \(\/[^ ]*\).*/\1/p' | sort -u)
    echo "container: the libraries of the programs come with its packages"
  fi
  local builder=
  for builder in buildah podman; do has "$builder" && break || builder=; done
  if [[ -z $builder ]]; then
    left_out "building the container: there is neither buildah nor podman"
  elif [[ $build_container == no ]]; then
    left_out "building the container (minutes): --build-container does"
  elif [[ $builder == buildah ]]; then
    buildah build -t bedflow -f deploy/container/Containerfile .
  else
    podman build -t bedflow -f deploy/container/Containerfile .
  fi
}

check_kubernetes() {
  if python3 -c 'import yaml' 2>/dev/null; then
    python3 deploy/kubernetes/check.py deploy/kubernetes/*.yaml
    # A check that cannot fail is none.
    sed 's/runAsUser/runAsUsers/' deploy/kubernetes/bedflow.yaml >"$scratch/wrong.yaml"
    if python3 deploy/kubernetes/check.py "$scratch/wrong.yaml" 2>/dev/null; then fail "a field that does not exist was not found"; fi
  else
    left_out "the Kubernetes files: there is no python3-yaml"
  fi
}

check_scripts() {
  if has shellcheck; then
    shellcheck deploy/*.sh
    echo "scripts: shellcheck finds nothing"
  else
    left_out "the scripts: there is no shellcheck"
  fi
}

check_unit
check_configuration
check_container
check_kubernetes
check_scripts
