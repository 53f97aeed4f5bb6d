#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Puts what `retint VERB --help` prints below each `<!-- help: VERB -->` of docs/cli.md, and what
# `retint VERB` prints below each `<!-- output: VERB -->`.
#   bash apps/update_cli_doc.sh [RETINT]    RETINT: the executable; built where not given
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
retint=${1:-$root/$(bash "$root/apps/build.sh" retint)/apps/retint}
doc=$root/docs/cli.md
new=$(mktemp)
trap 'rm -f "$new"' EXIT
skipping=false
while IFS= read -r line; do
  if $skipping; then
    # The old listing runs to its closing fence.
    [[ $line == '```text' ]] && in_fence=true && continue
    if $in_fence; then
      [[ $line == '```' ]] && skipping=false
      continue
    fi
    skipping=false
  fi
  printf '%s\n' "$line"
  if [[ $line =~ ^'<!-- '(help|output)': '(.*)'-->'$ ]]; then
    verb=${BASH_REMATCH[2]% }
    help=()
    [[ ${BASH_REMATCH[1]} == help ]] && help=(--help)
    printf '```text\n%s\n```\n' "$("$retint" ${verb:+"$verb"} "${help[@]}")"
    skipping=true in_fence=false
  fi
done <"$doc" >"$new"
cat "$new" >"$doc"
