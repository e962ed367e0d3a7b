#!/usr/bin/env bash
# Certificates of an authority of your own, for servers that no public authority vouches for.
# usage: deploy/certificates.sh FOLDER HOST...          server.pem, server.key for these names and addresses
#        deploy/certificates.sh FOLDER --client NAME    NAME.pem, NAME.key, for a server with --client-ca
# The authority, ca.pem and ca.key, is made in FOLDER when it is not there yet. Keep ca.key to yourself; clients need ca.pem.
# DAYS (397 if not set) is how long a certificate holds; run it again to renew one: a server takes it without a restart.
set -euo pipefail

if [[ $# -lt 2 ]]; then
  sed -n '2,6s/^# //p' "$0" >&2
  exit 2
fi
folder=$1
shift
days=${DAYS:-397}
umask 077
mkdir -p "$folder"
work=$(mktemp -d "$folder/new.XXXXXX")
trap 'rm -rf "$work"' EXIT

make_key() { openssl genpkey -quiet -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1" 2>/dev/null ||
             openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1" 2>/dev/null; }

if [[ ! -e $folder/ca.key ]]; then
  make_key "$work/ca.key"
  openssl req -x509 -new -key "$work/ca.key" -days 3650 -subj "/CN=bedflow authority of $(hostname)" -out "$work/ca.pem" \
    -addext "basicConstraints=critical,CA:TRUE,pathlen:0" -addext "keyUsage=critical,keyCertSign,cRLSign"
  mv "$work/ca.key" "$work/ca.pem" "$folder/"
fi

# sign NAME SUBJECT USAGE [ALTERNATIVE NAMES]
sign() {
  make_key "$work/$1.key"
  openssl req -new -key "$work/$1.key" -subj "/CN=$2" -out "$work/$1.csr"
  { echo "basicConstraints=critical,CA:FALSE"; echo "keyUsage=critical,digitalSignature"; echo "extendedKeyUsage=$3"
    [[ -z ${4:-} ]] || echo "subjectAltName=$4"; } >"$work/$1.ext"
  openssl x509 -req -in "$work/$1.csr" -CA "$folder/ca.pem" -CAkey "$folder/ca.key" -set_serial "0x$(openssl rand -hex 16)" \
    -days "$days" -extfile "$work/$1.ext" -out "$work/$1.pem" 2>/dev/null
  mv "$work/$1.key" "$work/$1.pem" "$folder/"
}

if [[ $1 == --client ]]; then
  name=${2:?usage: deploy/certificates.sh FOLDER --client NAME}
  [[ $name =~ ^[A-Za-z0-9][A-Za-z0-9._-]*$ && $name != ca && $name != server ]] || { echo "$name cannot be the name of a client" >&2; exit 2; }
  sign "$name" "$name" clientAuth
  echo "$folder/$name.pem $folder/$name.key: a client's, good for $days days"
else
  alternatives=
  for host in "$@"; do
    kind=DNS
    [[ $host =~ ^[0-9.]+$ || $host == *:* ]] && kind=IP
    alternatives+=${alternatives:+,}$kind:$host
  done
  sign server "$1" serverAuth "$alternatives"
  echo "$folder/server.pem $folder/server.key: the server's, for $*, good for $days days; clients need $folder/ca.pem"
fi
