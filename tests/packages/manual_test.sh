#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The man page has every verb and option of the program, and shells complete them. $1: retint
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

verbs=$("$retint" -h | sed -n '/^Examples:/q; s/^  \([a-z]\+\) .*/\1/p')
[[ $(wc -w <<<"$verbs") -ge 10 ]] || fail "--help lists too few verbs: $verbs"
for verb in $verbs; do
  [[ $text == *".SS retint $verb"$'\n'* ]] || fail "the page lacks $verb"
  [[ $(complete_words retint "$verb") == " $verb " ]] || fail "bash does not complete $verb"
  for flag in $("$retint" "$verb" --help | sed -n 's/^  \(-[a-z], \)\?\(--[a-z-]*\).*/\2/p'); do
    [[ $text == *"$flag"* ]] || fail "the page lacks $flag of $verb"
    [[ $(complete_words retint "$verb" "$flag") == *" $flag "* ]] || fail "bash does not complete $flag of $verb"
  done
done
[[ $(complete_words retint recolor --depth-method ste) == ' stereo-hv ' ]] || fail "bash does not complete a depth method"
[[ $(complete_words retint info --images "$(dirname "$0")/consu") == *'/consumer ' ]] || fail "bash does not complete a folder"
[[ $(complete_words retint recolor --output a) == '  ' ]] || fail "bash offers words for a file"
[[ $(complete_words retint recolor --to teal) == ' teal ' ]] || fail "bash does not complete a color"
[[ $(complete_words retint recolor --set ridge_re) == ' ridge_rest= ' ]] || fail "bash does not complete an option"
[[ $(complete_words retint recolor --set solver = m) == ' mm ' ]] || fail "bash does not complete an option's value"
[[ $(complete_words retint recolor --set solver =) == ' mm adam ' ]] || fail "bash does not offer an option's values"
[[ $(complete_words retint recolor --set tau =) == '  ' ]] || fail "bash offers words for a number"
for shell in zsh fish; do
  script=$("$retint" manual $shell)
  [[ $script == *outside-weight* && $script == *ridge_rest=* ]] || fail "$shell lacks an option"
  if command -v $shell >/dev/null; then $shell -n <<<"$script" || fail "$shell does not read its script"; fi
done
if command -v groff >/dev/null; then
  warnings=$(groff -man -Kutf8 -Tutf8 -ww -Wbreak <<<"$page" 2>&1 >/dev/null || true)
  [[ -z $warnings ]] || fail "groff: $warnings"
fi
