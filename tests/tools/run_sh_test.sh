#!/usr/bin/env bash
# run.sh as its user meets it: options, a first start that makes the case, the pages in Chromium, a second start, an end.
#   --help-only: only the options.
set -euo pipefail
cd "$(dirname "$0")/../.."
fail() { echo "run_sh_test: $*" >&2; exit 1; }

./run.sh --help | grep -q -- '--port' || fail "--help does not list --port"
status=0; ./run.sh --bogus 2>/tmp/run_sh_error.$$ || status=$?
[ $status = 2 ] || fail "an unknown option ends with $status, not 2"
[ "$(wc -l </tmp/run_sh_error.$$)" = 1 ] || fail "an unknown option does not give one line"
rm -f /tmp/run_sh_error.$$
status=0; ./run.sh --port http 2>/dev/null || status=$?
[ $status = 2 ] || fail "--port http ends with $status, not 2"
[ "${1:-}" = --help-only ] && exit 0

work=$(mktemp -d)
server=
trap '[ -n "$server" ] && kill "$server" 2>/dev/null; rm -rf "$work"' EXIT

# start: sets `server` and `address`.
start() {
  ./run.sh --port 0 --data "$work/data" >"$work/out" 2>"$work/err" &
  server=$!
  for _ in $(seq 1 3000); do
    address=$(sed -n 's/^.*\(http:[^ ]*\).*$/\1/p' "$work/out")
    [ -n "$address" ] && return
    kill -0 "$server" 2>/dev/null || { cat "$work/err" >&2; fail "run.sh ended before it served"; }
    sleep 0.1
  done
  fail "run.sh printed no address in 300 s"
}
stop() { kill -TERM "$server"; wait "$server" || fail "the server ended with $?"; server=; }

start
[ "$(wc -l <"$work/out")" = 1 ] || fail "run.sh prints more than one line on standard output"
[ -z "$(grep -F "$PWD" "$work/out")" ] || fail "the line names a path of the machine"
node --input-type=module -e 'const at = process.argv[1];
  const page = await (await fetch(at)).text();
  const { cases } = await (await fetch(new URL("/api/v1/cases", at))).json();
  if (!page.includes("<script") || cases.length !== 1 || cases[0].paths !== 2) throw new Error("no page, or no ready case");
' "$address" || fail "the address shows no page with a ready case"
stop
SPINALTAP_E2E_DATA=$work/data npm --prefix web run --silent e2e
start   # the second start finds the case and rebuilds nothing
grep -q 'preparing a demonstration case' "$work/err" && fail "a second start makes the case again"
stop
echo "run.sh serves, is used, stops and starts again"
