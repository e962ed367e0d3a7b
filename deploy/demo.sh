#!/usr/bin/env bash
# The main job on real input, in minutes: the Müller bed (9240 particles, 18 x 48 x 4 cells) through the server on 2 ranks for 0.5
# simulated seconds; half-way everything is killed, and the job goes on from its checkpoint. Ends with the void fraction and the
# bed height with their 95 % intervals, two pictures and a file for ParaView.
# usage: deploy/demo.sh [folder for the results; bedflow-data/demo-<time> if absent]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

deploy/install.sh
deploy/build.sh release bedflow bedflowd bedflow-engine
PATH=$PWD/build/release/bin:$PATH
data=${1:-bedflow-data/demo-$(date +%Y%m%d-%H%M%S)}
mkdir -p "$data"
address=unix:$(realpath "$data")/bedflowd.sock
end=0.5
half=0.25

say() { printf '\n== %s\n' "$*"; }

# Time that the job has reached, s; 0 while it settles.
reached() {
  bedflow get "$1" --server "$address" -o json 2>/dev/null |
    python3 -c 'import json, sys; print(json.load(sys.stdin).get("progress", {}).get("time", 0))' 2>/dev/null || echo 0
}

# Processes of a session, from field 6 of /proc/<pid>/stat.
session_members() {
  local stat line fields
  for stat in /proc/[0-9]*/stat; do
    read -r line <"$stat" 2>/dev/null || continue
    read -r -a fields <<<"${line##*) }"
    [[ ${fields[3]} == "$1" ]] && echo "${line%% *}"
  done
}

say "the case: the ready case \"mueller\", shortened to $end s with averages over 6 bins of 0.05 s"
shorter=()
while read -r monitor; do
  shorter+=(--set "$monitor.start=0.2" --set "$monitor.bin=0.05" --set "$monitor.bins=6")
done < <(bedflow init mueller -o json | python3 -c '
import json, sys
for number, monitor in enumerate(json.load(sys.stdin)["monitors"]):
    if "averaging" in monitor: print(f"monitors[{number}].averaging")')
bedflow init mueller --set "time.end=$end" "${shorter[@]}" >"$data/case.txtpb"
echo "$data/case.txtpb"
bedflow explain "$data/case.txtpb" --ranks 2

say "bedflow run $data/case.txtpb --ranks 2 --data $data --checkpoint-every 0.1"
bedflow run "$data/case.txtpb" --ranks 2 --data "$data" --checkpoint-every 0.1 </dev/null &
client=$!
trap 'kill "$client" 2>/dev/null || true' EXIT
job=
while kill -0 "$client" 2>/dev/null; do
  if [[ -z $job && -d $data/jobs ]]; then job=$(cd "$data/jobs" && find . -mindepth 1 -maxdepth 1 -name 'j-*' -printf '%f\n' -quit); fi
  if [[ -n $job ]] && python3 -c "import sys; sys.exit(not $(reached "$job") >= $half)"; then break; fi
  sleep 0.5
done
if ! kill -0 "$client" 2>/dev/null; then
  echo "deploy/demo.sh: the job ended before it was half done" >&2
  exit 1
fi

folder=$data/jobs/$job
runner=$(sed -n 's/^pid: //p' "$folder"/attempts/1/runner.txtpb)
server=$(cat /proc/"$client"/task/*/children)
mapfile -t engine < <(session_members "$runner")
printf '\n'
say "half-way, as if the power had gone: kill -9 of client $client, server $server and engine ${engine[*]}"
# shellcheck disable=SC2086  # children are a list
kill -KILL "$client" $server "${engine[@]}"
wait "$client" 2>/dev/null || true
trap - EXIT

say "bedflow run --resume $data/$job"
bedflow run --resume "$data/$job" </dev/null >/dev/null  # what it measured is shown below

say "void fraction across the bed and bed height, with 95 % intervals"
mapfile -t shown < <(python3 -c '
import json, sys
for monitor in json.load(sys.stdin)["monitors"]:
    if "void_fraction" in monitor or "bed_height" in monitor: print(monitor["name"])' \
  < <(bedflow init mueller -o json))
bedflow stats "$folder" "${shown[@]}"
bedflow plot "$folder" "${shown[@]}" -o "$data/profiles.png"
bedflow render "$folder" -o "$data/bed.png"

say "what there is now"
echo "pictures:  $data/profiles.png  $data/bed.png"
echo "ParaView:  $(printf '%s ' "$folder"/plots/*.series)"
echo "job:       $folder  (bedflow stats, plot, render and logs read it)"
