#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Which commit messages .ci/subjects.sh refuses, in a repository made for it.
set -euo pipefail
command -v git >/dev/null || exit 77
ci=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/.ci
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null
export GIT_AUTHOR_NAME=a GIT_AUTHOR_EMAIL=a@b GIT_COMMITTER_NAME=a GIT_COMMITTER_EMAIL=a@b
unset RETINT_BASE GIT_DIR GIT_WORK_TREE GIT_INDEX_FILE
git init -q
mkdir .ci
cp "$ci/subjects.sh" .ci

fail() {
  echo "subjects_test.sh: $1" >&2
  exit 1
}
commit() { git commit -q --allow-empty "${@/#/-m}"; }

commit "What came before the base is not checked."
git rev-parse HEAD >.ci/subjects-from

# Its messages for one commit after the base.
check() {
  git reset -q --hard "$(<.ci/subjects-from)"
  commit "$@"
  bash .ci/subjects.sh 2>&1
}
accepted() { check "$@" >out || fail "'$1' was refused: $(<out)"; }
refused() {
  local reason=$1
  shift
  if check "$@" >out; then fail "'$1' was accepted"; fi
  grep -qF -- "$reason" out || fail "of '$1' it says: $(<out)"
  grep -qF 'git rebase -i' out || fail "of '$1' it does not say how to reword"
}

sixty=$(printf 'Add %056d' 0)
accepted "Read records with out-of-range numbers as missing" "They are rare."
accepted "$sixty" "It just fits."
accepted "Measure the angle in °, not in radians of the second view é" "59 characters, 61 bytes."
accepted "Pass the view by name" "ss ends a verb."
accepted "Embed the page's figures" "An exception."
refused "is 61 characters long" "${sixty}0" "One more."
refused "ends with a period" "Add a view." "Why not."
refused "has no body" "Add a view"
for subject in "Added a view" "Adding a view" "Adds a view" "A view is added" "What is added"; do
  refused "does not begin with an imperative" "$subject" "A body."
done

# The base may be given; where this copy does not have it, a line says so.
RETINT_BASE=HEAD bash .ci/subjects.sh || fail "a commit before \$RETINT_BASE was checked"
RETINT_BASE=$(printf '%040d' 1) bash .ci/subjects.sh >out 2>&1 || fail "an unknown base fails"
grep -qF 'are not checked' out || fail "of an unknown base it says: $(<out)"
