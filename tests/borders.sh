#!/usr/bin/env bash
# Fails on an include that crosses the borders: tracking, sim, render and audio know themselves alone, app knows all, nobody includes app or tests.
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
GL/|assimp/|spng|isa-l/:render
csound|sndfile|smf:audio
Spectra/:sim
zmq:sim|app
CLI/|toml\+\+/|nlohmann/|lo/:app
LIST
exit $status
