#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds and runs an outside project that uses bevel's libraries.
#
# Usage: consumer_test.sh installed BUILD [CMAKE OPTION...]
#        consumer_test.sh shared|source|model_only SOURCE [CMAKE OPTION...]
#   installed   installs the build folder BUILD into a temporary prefix; the project calls find_package(bevel)
#   shared      builds and installs shared libraries of model and estimator; the project calls find_package(bevel)
#   source      the project adds the source tree SOURCE by FetchContent
#   model_only  builds and installs model with every other package disabled, and prints how long that took
# CMake options are passed on, so that ccache finds the objects of the main build.
# Exit status: 0 passed, 1 failed, 2 usage.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0" >&2; exit 2; }
mode=$1 tree=$2
shift 2
here=$(cd "$(dirname "$0")/project" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
launcher=()
command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
configure() { cmake -G Ninja -DCMAKE_BUILD_TYPE=Release "$@" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }; }
quietly() { "$@" >"$work/log" 2>&1 || { tail -n 50 "$work/log" >&2; exit 1; }; }

run_consumer() {  # run_consumer CMAKE OPTION...: builds and runs the outside project with all warnings as errors
  configure -S "$here" -B "$work/consumer" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" "$@"
  quietly cmake --build "$work/consumer"
  "$work/consumer/consumer"
}

case $mode in
  installed)
    quietly cmake --install "$tree" --prefix "$work/prefix"
    run_consumer -DCMAKE_PREFIX_PATH="$work/prefix"
    ;;
  shared)
    configure -S "$tree" -B "$work/build" -DBUILD_SHARED_LIBS=ON "-DBEVEL_COMPONENTS=model;estimator" "$@"
    quietly cmake --build "$work/build"
    quietly cmake --install "$work/build" --prefix "$work/prefix"
    run_consumer -DCMAKE_PREFIX_PATH="$work/prefix"
    ldd "$work/consumer/consumer" | grep -q 'libbevel_estimator\.so\.[0-9]*\.[0-9]* =>' ||
      { echo "consumer: the program does not use libbevel_estimator.so with its version" >&2; exit 1; }
    ;;
  source)
    # Without -Werror: the flags are also those of bevel's own sources here.
    run_consumer -DBEVEL_SOURCE="$tree" -DCMAKE_CXX_FLAGS= "${launcher[@]}" "$@"
    ;;
  model_only)
    disabled=()
    for package in Boost Ceres OpenCV CLI11 nlohmann_json OpenSSL ZLIB Threads GTest benchmark PkgConfig Python3; do
      disabled+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
    done
    configure -S "$tree" -B "$work/build" -DBEVEL_COMPONENTS=model "${disabled[@]}" "$@"
    found=$(sed -n 's/^\([A-Za-z0-9_]*\)_DIR:PATH=.*/\1/p' "$work/build/CMakeCache.txt" | tr '\n' ' ')
    [ "$found" = "Eigen3 " ] || { echo "consumer: a model-only build looks for: $found; allowed: Eigen3" >&2; exit 1; }
    export CCACHE_DISABLE=1
    start=$SECONDS
    quietly cmake --build "$work/build"
    echo "model: built in $((SECONDS - start)) s on $(nproc) processors, without ccache"
    quietly cmake --install "$work/build" --prefix "$work/prefix"
    [ -e "$work/prefix/include/bevel/model/kinematics.hpp" ] || { echo "consumer: no header is installed" >&2; exit 1; }
    ;;
  *) echo "consumer: unknown mode '$mode'; allowed: installed, shared, source, model_only" >&2; exit 2 ;;
esac
