#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# plugin_test.sh BUILD_DIR TEST.java JAVAC LCM_JAR [PICTURE.png]: compiles the test against the plug-in as built, runs it.
set -euo pipefail
build=$1 source=$2 javac=$3 lcm=$4
types=$build/lcmtypes/bevel_lcmtypes.jar plugin=$build/tools/spy/bevel_spy_plugin.jar
[ -x "$javac" ] && [ -e "$lcm" ] || { echo "skipped: no JDK (Debian: default-jdk-headless) or no lcm.jar"; exit 77; }
for jar in "$types" "$plugin"; do [ -e "$jar" ] || { echo "FAILED: no $jar"; exit 1; }; done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$javac" -Xlint:all -Werror -cp "$lcm:$types:$plugin" -d "$work" "$source"
java -Djava.awt.headless=true -cp "$work:$lcm:$types:$plugin" bevel.spy.PathViewTest ${5:+"$5"}
