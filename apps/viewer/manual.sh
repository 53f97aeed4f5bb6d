#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Prints the man page of retint-viewer, from what its --help says: manual.sh RETINT-VIEWER
set -euo pipefail
viewer=$1
help=$("$viewer" --help)
version=$("$viewer" --version)
awk -v version="${version#* }" '
  function roff(text) {
    gsub(/\\/, "\\e", text); gsub(/-/, "\\-", text); gsub(/\047/, "\\(aq", text)
    return text ~ /^[.]/ ? "\\&" text : text
  }
  NR == 1 {
    sub(/^Usage: [^ ]*/, "")
    print ".TH RETINT\\-VIEWER 1 \"\" \"retint " roff(version) "\" \"User Commands\""
    print ".SH NAME\nretint\\-viewer \\- edit the colors of 3D Gaussian Splatting scenes"
    print ".SH SYNOPSIS\n\\fBretint\\-viewer\\fR" roff($0) "\n.SH DESCRIPTION"
    next
  }
  /^[A-Z][a-z]*:$/ { print ".SH " toupper(substr($0, 1, length($0) - 1)); listed = 1; next }
  /^$/ { next }
  !listed { print roff($0); next }
  /^  [^ ]/ {  # a name, at least two blanks, what it means
    text = substr($0, 3)
    if (match(text, /  +/)) {
      print ".TP\n\\fB" roff(substr(text, 1, RSTART - 1)) "\\fR\n" roff(substr(text, RSTART + RLENGTH))
    } else {
      print ".TP\n\\fB" roff(text) "\\fR"
    }
    next
  }
  { sub(/^ +/, ""); print roff($0) }
  END {
    print ".SH SEE ALSO\n.BR retint (1)"
  }' <<<"$help"
