#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The man page has every verb and option of the program, and bash completes them. $1: retint
set -euo pipefail
retint=$1
page=$("$retint" manual man)
fail() { echo "manual_test.sh: $*" >&2; exit 1; }

# Plain text of the page, without roff's escapes.
text=${page//\\-/-}
source <("$retint" manual bash)
complete_words() {  # of the words of a command line, the last one unfinished
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
  _retint
  printf ' %s' "${COMPREPLY[@]}"
  echo ' '
}

verbs=$("$retint" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[[ $(wc -w <<<"$verbs") -ge 10 ]] || fail "--help lists too few verbs: $verbs"
for verb in $verbs; do
  [[ $text == *".SS retint $verb"$'\n'* ]] || fail "the page lacks $verb"
  [[ $(complete_words retint "$verb") == " $verb " ]] || fail "bash does not complete $verb"
  for flag in $("$retint" "$verb" --help | sed -n 's/^  \(-h,\)\?\(--[a-z-]*\).*/\2/p'); do
    [[ $text == *"$flag"* ]] || fail "the page lacks $flag of $verb"
    [[ $(complete_words retint "$verb" "$flag") == *" $flag "* ]] || fail "bash does not complete $flag of $verb"
  done
done
[[ $(complete_words retint recolor --depth ste) == ' stereo-hv ' ]] || fail "bash does not complete a depth method"
[[ $(complete_words retint info --workspace "$(dirname "$0")/consu") == *'/consumer ' ]] || fail "bash does not complete a folder"
[[ $(complete_words retint recolor --output a) == '  ' ]] || fail "bash offers words for a file"
if command -v groff >/dev/null; then
  warnings=$(groff -man -Kutf8 -Tutf8 -ww -Wbreak <<<"$page" 2>&1 >/dev/null || true)
  [[ -z $warnings ]] || fail "groff: $warnings"
fi
