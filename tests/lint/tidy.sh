#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fails where clang-tidy 14 has something to say of a source or of a header that it includes.
#
#     tidy.sh BUILD    BUILD is configured with the preset `tidy`; only headers are generated, nothing is compiled
#
# It begins with another eighth of the sources after every eight commits, so that runs which are cut short come to all
# of them in turn; it ends at the first source with a finding.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$1
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

ninja -C "$build" -t targets rule CUSTOM_COMMAND | grep -E '\.(h|cxx)$' | xargs -r ninja -C "$build"

mapfile -t sources < <(
  git ls-files '*.cpp' | grep -Fxf <(
    python3 -c 'import json, os, sys
for entry in json.load(open(sys.argv[1])): print(os.path.relpath(entry["file"]))' "$build/compile_commands.json")
)
all=${#sources[@]}
commits=$(git rev-list --count HEAD)
first=$((commits / 8 % 8 * all / 8))
for ((k = 0; k < all; ++k)); do
  echo "$((k + 1))/$all ${sources[(first + k) % all]}"
done | xargs -P "$jobs" -L 1 bash -c '
  echo "[$1] $2"
  clang-tidy -p "$0" --quiet "$2" 2> >(grep -v "warnings* generated\.$" >&2) || exit 255
' "$build" || exit 1 # xargs says 124, which would mean that the time was up.
