# docker/steps.sh - the steps that run.sh, test.sh and the image share. Sourced, never run: each function is one step.
# A step that has nothing to do costs well under a second, so a second start is quick.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$top/build
export NODE_PATH=/usr/share/nodejs   # Debian's emscripten looks for acorn there
export CCACHE_MAXSIZE=${CCACHE_MAXSIZE:-3G}
export npm_config_update_notifier=false npm_config_fund=false npm_config_audit=false
node_wanted=22.23.3                  # fetched when the machine's own is older than 20.19, which Vite needs

say() { printf '\033[1m== %s\033[0m\n' "$*" >&2; }

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }

# Installs the Debian packages of docker/packages.txt that are missing; `headless` leaves nothing out today.
install_packages() {
  local wanted missing
  wanted=$(grep -v '^#' "$top/docker/packages.txt")
  command -v node >/dev/null && command -v npm >/dev/null || wanted="$wanted nodejs npm"
  missing=$(comm -23 <(sort -u <<<"$(tr ' ' '\n' <<<"$wanted")") \
    <(dpkg-query -W -f '${db:Status-Abbrev}${Package}\n' 2>/dev/null | sed -n 's/^ii //p' | sort -u))
  [ -z "$missing" ] && return
  say "installing $(wc -w <<<"$missing") Debian packages"
  as_root apt-get update -qq
  # shellcheck disable=SC2086
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
}

# Debian 12's node is 18; a newer one comes as an npm package into build/node, nothing system-wide.
use_node() {
  if node -e 'const [a,b]=process.versions.node.split(".").map(Number);process.exit(a>20||(a===20&&b>=19)?0:1)'; then
    return
  fi
  local machine
  case $(uname -m) in x86_64) machine=x64 ;; aarch64) machine=arm64 ;; *) echo "no node for $(uname -m)" >&2; return 1 ;; esac
  local package=node-linux-$machine
  if [ ! -x "$build/node/node_modules/$package/bin/node" ]; then
    say "fetching node $node_wanted"
    npm install --silent --prefix "$build/node" "$package@$node_wanted"
  fi
  PATH=$build/node/node_modules/$package/bin:$PATH
}

# configure PRESET: once, and again when the cache is gone.
configure() {
  [ -f "$build/$1/build.ninja" ] && return
  (cd "$top" && cmake --preset "$1" >"$build/$1.configure.log" 2>&1) || { tail -n 30 "$build/$1.configure.log" >&2; return 1; }
}

# build_native PRESET TARGET...
build_native() {
  local preset=$1; shift
  mkdir -p "$build"
  configure "$preset"
  cmake --build "$build/$preset" --target "$@"
}

# A stamp of the content of files under version control or new, below the paths given.
stamp_of() {
  (cd "$top" && git ls-files -co --exclude-standard -z -- "$@" 2>/dev/null | sort -z | xargs -0 sha256sum 2>/dev/null | sha256sum)
}

install_npm() {
  local stamp; stamp=$(sha256sum <"$top/web/package-lock.json")
  [ "$(cat "$top/web/node_modules/.spinaltap-stamp" 2>/dev/null)" = "$stamp" ] && return
  say "installing npm packages"
  # Not `npm ci`: the lock holds only the platforms that the registry at hand offers, and ci insists on all of them.
  # The versions and checksums of the lock are used all the same, and it is not rewritten.
  (cd "$top/web" && npm install --no-save --silent)
  echo "$stamp" >"$top/web/node_modules/.spinaltap-stamp"
}

build_web() {
  install_npm
  local stamp; stamp=$(stamp_of web; sha256sum <"$build/wasm/bin/spinaltap_core.wasm")
  [ -f "$build/web/dist/index.html" ] && [ "$(cat "$build/web/stamp" 2>/dev/null)" = "$stamp" ] && return
  say "building the web pages"
  (cd "$top/web" && npm run --silent build)
  echo "$stamp" >"$build/web/stamp"
}

build_program() {
  say "building the program"
  build_native release spinaltap spinaltap-import
  say "building the browser's core"
  build_native wasm spinaltap_core
  build_web
}
