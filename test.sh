#!/usr/bin/env bash
# The same set-up as run.sh, then every test. Prints one line a step and, last, how many passed.
#   ./test.sh            everything
#   ./test.sh STEP ...   some of: lint native wasm web sanitize tidy
source "$(dirname "${BASH_SOURCE[0]}")/docker/steps.sh"
cd "$top"
passed=0 failed=0 failures=()

# check NAME COMMAND...: runs it, shows its last lines when it fails, and goes on, so that one run shows all that is wrong.
check() {
  local name=$1 log started=$SECONDS; shift
  log=$build/logs/${name// /-}.log
  if "$@" >"$log" 2>&1; then
    passed=$((passed + 1)); printf 'ok   %4ds  %s\n' $((SECONDS - started)) "$name"
  else
    failed=$((failed + 1)); failures+=("$name"); printf 'FAIL %4ds  %s\n' $((SECONDS - started)) "$name"
    tail -n "${TEST_TAIL:-60}" "$log" | sed 's/^/     /'
  fi
}
runs() { [ $# -gt 1 ] || return 0; local step=$1; shift; [[ " $* " == *" $step "* ]]; }

steps=("$@")
install_packages
use_node
mkdir -p "$build/logs"

if runs lint "${steps[@]}"; then
  check "layout and includes" python3 tests/tools/check_layout.py
  check "layout checker finds planted faults" python3 tests/tools/check_layout_test.py
  check "docker files" python3 tests/tools/check_docker.py
  check "C++ format" tests/tools/check_format.sh
  check "npm packages" install_npm
  check "TypeScript lint and types" npm --prefix web run --silent check
fi
if runs native "${steps[@]}"; then
  check "build, native" build_native release all
  check "tests, native" ctest --preset release
  check "start and stop of run.sh" tests/tools/run_sh_test.sh --help-only
fi
if runs wasm "${steps[@]}"; then
  check "build, WebAssembly" build_native wasm all
  check "core tests as WebAssembly" ctest --preset wasm
  check "bindings under node" node --test tests/wasm/
fi
if runs web "${steps[@]}"; then
  check "build, web" build_program
  check "web unit tests" npm --prefix web test --silent
  check "run.sh and the pages in Chromium" tests/tools/run_sh_test.sh
fi
if runs sanitize "${steps[@]}"; then
  check "build, sanitizers" build_native sanitize core_and_import_tests
  check "core and import under sanitizers" ctest --preset sanitize -R '^(core_|server_import)'
fi
if runs tidy "${steps[@]}"; then
  check "clang-tidy" tests/tools/run_tidy.sh
fi

[ $failed -gt 0 ] && printf 'failed: %s\n' "${failures[@]}"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
