#!/usr/bin/env bash
# Installs what is missing, builds, and serves SpinalTap with a ready case. See --help.
usage() {
  cat <<'TEXT'
Usage: ./run.sh [--port N] [--address A] [--data DIR] [--build-only] [--help]

Installs the missing Debian and npm packages, builds the program and the web pages, prepares a demonstration case if
the data folder has none, and serves it. Prints one line with the address when it is ready; Ctrl-C stops it.

  --port N       port to listen on (default 8080; 0 takes a free one)
  --address A    address to listen on (default 127.0.0.1)
  --data DIR     data folder (default $SPINALTAP_DATA, else ~/.local/share/spinaltap)
  --build-only   stop after building
TEXT
}
port=8080 address=127.0.0.1 data=${SPINALTAP_DATA:-${HOME:?}/.local/share/spinaltap} build_only=
while [ $# -gt 0 ]; do
  case $1 in
    --port) port=${2:?--port needs a number}; shift 2 ;;
    --address) address=${2:?--address needs an address}; shift 2 ;;
    --data) data=${2:?--data needs a folder}; shift 2 ;;
    --build-only) build_only=yes; shift ;;
    -h | --help) usage; exit 0 ;;
    *) echo "run.sh: unknown option '$1' (see ./run.sh --help)" >&2; exit 2 ;;
  esac
done
case $port in '' | *[!0-9]*) echo "run.sh: --port needs a number, not '$port'" >&2; exit 2 ;; esac

source "$(dirname "${BASH_SOURCE[0]}")/docker/steps.sh"
install_packages
use_node
build_program >&2
[ -n "$build_only" ] && exit 0

program=$build/release/bin/spinaltap
"$top/docker/demo_case.sh" "$program" "$data"
exec "$program" serve --data "$data" --address "$address" --port "$port" --web "$build/web/dist"
