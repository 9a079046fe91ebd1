#!/usr/bin/env bash
# demo_case.sh PROGRAM DATA: makes the demonstration case, unless DATA has a case with a path already.
# The CT is the program's own phantom; its truth.json knows where the pedicles are.
set -euo pipefail
program=$1 data=$2
mkdir -p "$data"
cases=$("$program" cases --data "$data" --json | python3 -c 'import json,sys; print(sum(c["paths"] > 0 for c in json.load(sys.stdin)["cases"]))')
[ "$cases" != 0 ] && exit 0

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
field() { python3 -c 'import json,sys; v=json.load(sys.stdin)
for k in sys.argv[1].split("."): v=v[k]
print(",".join(map(str,v)) if isinstance(v,list) else v)' "$1"; }
truth() { field "$1" <"$work/ct/truth.json"; }

echo "preparing a demonstration case (about half a minute) ..." >&2
"$program" phantom --out "$work/ct" --json >/dev/null
id=$("$program" import --from "$work/ct" --name "Phantom L3" --data "$data" --json | field case_id)
"$program" segment "$id" --seed "$(truth seed_point_patient)" --data "$data" --json >/dev/null
"$program" reconstruct "$id" --data "$data" --json >/dev/null
for side in left right; do
  "$program" plan "$id" --label "$side pedicle" --entry "$(truth "pedicles.$side.entry_patient")" \
    --target "$(truth "pedicles.$side.target_patient")" --bit-diameter 3.0 --data "$data" --json >/dev/null
done
