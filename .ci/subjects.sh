#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks the messages of the commits after $RETINT_BASE, or else after the commit that
# .ci/subjects-from names: an imperative subject of at most 60 characters, and a body
# (CONTRIBUTING.md). Names every commit that breaks a rule and fails if there is one.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export LC_ALL=C.UTF-8  # so that a character counts once

git() { command git -c safe.directory='*' "$@"; }
base=${RETINT_BASE:-$(<.ci/subjects-from)}
if ! git cat-file -e "$base^{commit}" 2>/dev/null; then
  echo "Commit subjects are not checked: this copy does not have commit $base." >&2
  exit 0
fi

# Verbs that end as no imperative does, and first words that begin a sentence instead.
verbs=' alias bias bring embed exceed feed focus need proceed ring seed speed spring string succeed '
others=' a all an and any every in it its no not of one that the there these this what when where '

# Prints what is wrong with a subject, or nothing.
fault() {
  local subject=$1 first=${1%% *}
  first=${first,,}
  if ((${#subject} > 60)); then echo "is ${#subject} characters long; at most 60 are allowed"; fi
  if [[ $subject == *. ]]; then echo "ends with a period"; fi
  if [[ $verbs == *" $first "* || $first == *ss ]]; then return; fi
  if [[ $others == *" $first "* || $first == *ed || $first == *ing || $first == *s ]]; then
    echo "does not begin with an imperative, such as \"Add\" or \"Fix\""
  fi
}

bad=0
while read -r commit; do
  subject=$(git log -1 --format=%s "$commit")
  faults=$(fault "$subject")
  if [[ -z $(git log -1 --format=%b "$commit") ]]; then faults+=$'\n'"has no body that says why"; fi
  while read -r line; do
    if [[ -z $line ]]; then continue; fi
    echo "${commit:0:10} \"$subject\" $line" >&2
    bad=1
  done <<<"$faults"
done < <(git rev-list --no-merges --reverse "$base..HEAD")
if ((bad)); then
  echo "Reword these commits: run \"git rebase -i $base\" and put \"reword\" before each." >&2
fi
exit "$bad"
