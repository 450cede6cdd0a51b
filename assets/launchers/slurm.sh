#!/usr/bin/env bash
# One scene on a Slurm allocation: the application in the batch script, a worker a task by srun.
#   sbatch slurm.sh SCENE OUT       OUT on a file system that all nodes share
# A worker is one thread; workers that their node loses are made up for by the others.
#SBATCH --job-name=musicworld
#SBATCH --nodes=2
#SBATCH --ntasks-per-node=8
#SBATCH --cpus-per-task=1
#SBATCH --time=00:30:00
#SBATCH --no-kill
set -euo pipefail
scene=$1 out=$2
musicworld=${MUSICWORLD:-musicworld}
port=$((20000 + SLURM_JOB_ID % 20000)) # jobs that share a node do not share a port

mkdir -p "$out"
keys=$out/keys-$SLURM_JOB_ID
trap 'rm -rf "$keys"' EXIT
"$musicworld" keys "$keys" --workers slurm

# The batch script runs on the allocation's first node, beside its tasks: hence --overlap.
srun --overlap --kill-on-bad-exit=0 "$musicworld" worker \
    --connect "tcp://$SLURMD_NODENAME:$port" --key "$keys/slurm.key" &
"$musicworld" simulate "$scene" --listen "tcp://0.0.0.0:$port" --keys "$keys" --expect "$SLURM_NTASKS" \
    --bound "${BOUND:-4}" --out "$out"
wait
