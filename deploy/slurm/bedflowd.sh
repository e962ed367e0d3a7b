#!/usr/bin/env bash
# An example of a site's settings: bedflowd on a login or service node of a cluster, with its jobs under Slurm. Change what is marked.
# What each flag means: bedflowd --help; how to operate it: deploy/OPERATING.md, "Running on Slurm".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

programs=/srv/bedflow/bin  # here and on all nodes the same programs under the same path
data=/srv/bedflow/data     # on the file system that the nodes share

exec "$programs/bedflowd" \
  --data "$data" \
  --slots 2 \
  --slurm \
  --slurm-option=--partition=long \
  --slurm-option=--account=beds \
  --slurm-option=--mail-type=NONE \
  --slurm-prologue "$here/prologue.sh" \
  --slurm-launcher "mpirun --bind-to core" \
  --slurm-memory \
  --slurm-most-ranks 512 \
  --slurm-poll-seconds 5 \
  --heartbeat-seconds 120
