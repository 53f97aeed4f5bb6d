#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the documents as a site, without a network, and checks its links.
#   bash apps/docs/build.sh [FOLDER]    default build/site; open FOLDER/index.html
# Needs mkdocs; the C++ headers are part of it where doxygen is installed. Exit code 77: mkdocs is missing.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
site=$(realpath -m "${1:-$root/build/site}")
if ! command -v mkdocs >/dev/null; then
  echo "build.sh: mkdocs is not installed (apt-get install mkdocs doxygen): the site is not built" >&2
  exit 77
fi
mkdocs build --quiet --strict --clean --config-file "$root/apps/docs/mkdocs.yml" --site-dir "$site"
python3 "$root/apps/docs/check_links.py" "$site"
echo "$site/index.html"
