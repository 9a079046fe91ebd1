#!/usr/bin/env bash
# clang-tidy over the project's C++ (not its tests). A file whose content, headers and rules did not change since it last
# passed is not looked at again.
set -euo pipefail
cd "$(dirname "$0")/../.."
mkdir -p build/tidy
common=$(cat .clang-tidy build/release/compile_commands.json $(git ls-files -co --exclude-standard 'core/*.h' 'server/*.h') | sha256sum | cut -c1-16)
tidy_one() {
  local stamp
  stamp=build/tidy/$(cat "$1" | sha256sum | cut -c1-24)-$common
  [ -f "$stamp" ] && return 0
  clang-tidy-19 --quiet -p build/release --extra-arg=-Wno-error --warnings-as-errors='*' "$1" 2>/dev/null && touch "$stamp"
}
export -f tidy_one
export common
git ls-files -co --exclude-standard -z 'core/*.cpp' 'server/*.cpp' | xargs -0 -P "$(nproc)" -I{} bash -c 'tidy_one {}'
