# SPDX-License-Identifier: MIT
# Functions of the scripts in tools/ci. Source this file.

# need_command COMMAND PACKAGE: installs the Debian package unless the command exists. Needs root or sudo to install.
need_command() {
  command -v "$1" >/dev/null && return 0
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  echo "$(basename "$0"): $1 is missing; installs the Debian package $2"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$2" >/dev/null
}
