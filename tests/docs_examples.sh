#!/usr/bin/env bash
# Runs every ```sh block of README.md and docs/*.md, a line at a time, with `./run` replaced by the program ($MUSICWORLD_PROGRAM); fails
# on a status other than 0. Each page has a folder of its own that goes away; the first ```toml block of the page lies there by the name that the
# page saves it as, or else as example.toml.
# Arguments: pages, all if left out.
set -uo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=${MUSICWORLD_PROGRAM:-$top/build/release/app/musicworld}
[ -x "$program" ] || { echo "no program at $program: build it, or set MUSICWORLD_PROGRAM"; exit 1; }
export MUSICWORLD_EXAMPLE_PROGRAM=$program
[ $# -gt 0 ] || set -- "$top"/README.md "$top"/docs/*.md
ran=0 failed=0
for page in "$@"; do
    page=$(realpath "$page")
    folder=$(mktemp -d)
    ln -s "$top/assets" "$folder/assets"
    name=$(sed -n 's/.*Save this as `\([^`]*[.]toml\)`.*/\1/p' "$page" | head -n 1)
    awk '/^```toml$/ { on = 1; next } /^```/ { if (on) exit } on' "$page" >"$folder/${name:-example.toml}"
    while IFS= read -r line; do
        [ -z "$line" ] && continue
        command=${line//.\/run/\"\$MUSICWORLD_EXAMPLE_PROGRAM\"}
        ran=$((ran + 1))
        if ! (cd "$folder" && bash -c "$command") </dev/null >"$folder/.output" 2>&1; then
            failed=$((failed + 1))
            printf 'FAILED %s: %s\n' "${page#"$top"/}" "$line"
            tail -5 "$folder/.output"
        fi
    done < <(awk '/^```sh$/ { on = 1; next } /^```/ { on = 0 } on' "$page" | sed -e ':a' -e '/\\$/ { N; s/\\\n *//; ba' -e '}')
    rm -rf "$folder"
done
printf '%d examples, %d failed\n' "$ran" "$failed"
[ "$ran" -gt 0 ] && [ "$failed" -eq 0 ]
