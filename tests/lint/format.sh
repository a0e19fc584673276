#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# format.sh [CLANG_FORMAT]: fails where a C++ file is not as clang-format 14 would write it.
cd "$(dirname "$0")/../.."
git ls-files '*.hpp' '*.cpp' | xargs -r "${1:-clang-format}" --dry-run --Werror
