#!/usr/bin/env bash
# One scene on this machine and workers on others, placed by ssh.
#   ssh.sh SCENE OUT HOST...        a worker each; name a host twice for two
# The hosts need `musicworld` (or say where: MUSICWORLD), their clocks nothing. They must reach this machine
# at ADDRESS (default: its first address) on PORT (default 5860). Each worker gets a key of its own, over
# ssh's standard input, and keeps it until it ends.
set -euo pipefail
scene=$1 out=$2
shift 2
musicworld=${MUSICWORLD:-musicworld}
address=${ADDRESS:-$(hostname -I | cut -d' ' -f1)}
port=${PORT:-5860}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
names=$(seq -f 'worker%g' -s, "$#")
"$musicworld" keys "$folder/keys" --workers "$names"

worker=0
for host in "$@"; do
    worker=$((worker + 1))
    # The remote shell puts the key into a file that only it can read, and takes it away at the end.
    ssh -o BatchMode=yes "$host" "umask 077; key=\$(mktemp); trap 'rm -f \$key' EXIT; cat >\$key
        $musicworld worker --connect tcp://$address:$port --key \$key" <"$folder/keys/worker$worker.key" &
done
# Workers look for the application for 10 s, so it may start last; they end when it does.
"$musicworld" simulate "$scene" --listen "tcp://0.0.0.0:$port" --keys "$folder/keys" --expect "$#" \
    --bound "${BOUND:-4}" --out "$out"
wait
