#!/usr/bin/env bash
# Fails on an include that crosses the borders: tracking, sim, render and audio know themselves alone, app knows all, nothing includes app or tests;
# and within app, sim and tracking on an arrow from a folder to one above it.
set -u
cd "$(dirname "$0")/.."
status=0
complain() { echo "border crossed: $1"; status=1; }
for folder in tracking sim render audio; do
    while IFS= read -r line; do
        for other in tracking sim render audio app tests; do
            [ "$other" = "$folder" ] && continue
            case "$line" in *[\<\"]"$other"/*) complain "$line" ;; esac
        done
    done < <(grep -rnE '^ *# *include *[<"]' "$folder" --include='*.h' --include='*.cpp')
done
# Libraries that belong to one folder.
while IFS=: read -r pattern folder; do
    found=$(grep -rlE "^ *# *include *[<\"]($pattern)" app tracking sim render audio --include='*.h' --include='*.cpp' | grep -vE "^($folder)/")
    [ -n "$found" ] && complain "$pattern belongs to $folder alone: $found"
done <<'LIST'
GL/|assimp/|spng:render
isa-l/:render
csound|sndfile:audio
bson/|fpzip:tracking
Spectra/:sim
zmq:sim|app
mujoco/|bt[A-Z]|Bullet:sim
CLI/|toml\+\+/|nlohmann/|lo/:app
LIST
# The folders of a library, from the ground up: each includes those before it in the list alone, so there is no circle. Files beside
# the folders stand above all of them.
floors() {
    local area=$1 below=" " folder line
    shift
    for folder in "$@"; do
        while IFS= read -r line; do
            local other=${line##*include \"}
            other=${other%%/*}
            [ "$other" = "$folder" ] && continue
            case " $* " in *" $other "*) ;; *) continue ;; esac
            case "$below" in *" $other "*) ;; *) complain "$line: $folder stands below $other" ;; esac
        done < <(grep -rnE '^#include "[a-z_]+/' "$area/src/$folder" --include='*.h' --include='*.cpp')
        below="$below$folder "
    done
    while IFS= read -r line; do complain "$line: a file above the folders"; done < <(grep -rnE '^#include "[a-z0-9_]+\.h"' "$area"/src/*/)
    for folder in "$area"/src/*/; do
        folder=$(basename "$folder")
        case " $* " in *" $folder "*) ;; *) complain "$area/src/$folder has no place among the floors" ;; esac
    done
}
floors app statistics files process report scene kit sticks strikes pictures sensors play traces simulate compare latency realtime commands
floors tracking trace drummer filter learned
floors sim bytes shape modes struck body contact solver world messages run accuracy shared workers
exit $status
