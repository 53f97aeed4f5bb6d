#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what the command line needs, builds it, recolors a scene, and leaves the result in demo/.
#   bash apps/demo.sh                    a sample scene that it makes itself
#   bash apps/demo.sh SCENE --view NAME --mask M.png --to '#3060ff'
# The second form takes every option of `retint recolor` except those that name outputs; SCENE comes
# first, --view and --mask may repeat. Both take --no-cuda and --cuda-arch LIST (see apps/build.sh).
# You can run it again: outputs are replaced, and only what changed is built. A build in build/release
# is used if there is one.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
demo=$root/demo
color='#3060ff'

fail() {
  echo "demo.sh: $1" >&2
  exit "${2:-2}"
}

# step NAME COMMAND...: runs the command, whose messages go to the log, and says how long it took.
log=$demo/log.txt
step() {
  local name=$1 begin=$SECONDS
  shift
  printf '%-20s' "$name" >&2
  if ! "$@" 2>>"$log"; then
    printf 'failed. The end of %s:\n' "$log" >&2
    tail -n 20 "$log" >&2
    return 1
  fi
  printf '%4d s\n' $((SECONDS - begin)) >&2
}

# What can be checked without building is checked first.
has_edit=false
has_picture=false
build_arguments=()
arguments=()
if [[ $# -gt 0 && $1 != -* ]]; then
  [[ -e $1 ]] || fail "$1: no such scene" 3
  arguments+=("$1")
  shift
fi
while (($# > 0)); do
  option=${1%%=*} # an option's value is the next word, or follows "="
  value=${2:-}
  [[ $1 == *=* ]] && value=${1#*=}
  case $option in
    --no-cuda) build_arguments+=("$1"); shift; continue ;;
    --cuda-arch)
      build_arguments+=("$1" "${2:?"--cuda-arch needs a list such as 86-real or all-major"}")
      shift 2
      continue ;;
    -h | --help) sed -n '3,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
    --output | -o | --report | --report-html | --no-report-html | --comparison | \
      --save-stages)
      fail "$option: the demo's outputs go to $demo" ;;
    --edited) has_edit=true has_picture=true ;;
    --to | --tint | --edit | --adjust | --lut | --gradient | --palette | --matrix | --exposure | --contrast | \
      --gamma | --white-balance | --saturation | --invert | --gray) has_edit=true ;;
    --splat | -s | --mask) [[ -f $value ]] || fail "$option $value: no such file" 3 ;;
  esac
  arguments+=("$1")
  shift
done
if ((${#arguments[@]} > 0)); then
  [[ ${arguments[0]} != -* ]] || fail "SCENE is missing (bash apps/demo.sh --help)"
  required=(--view --mask)
  $has_picture && required=() # an edited picture says itself where the change is
  for option in "${required[@]}"; do
    [[ " ${arguments[*]} " == *" $option "* || " ${arguments[*]} " == *" $option="* ]] ||
      fail "$option is missing (bash apps/demo.sh --help)"
  done
fi

mkdir -p "$demo"
: >"$log"
quick=()
if [[ ! -f $root/build/release/build.ninja ]]; then
  quick=(--quick)
  step "Install packages" bash "$root/apps/setup.sh" --for demo >>"$log" || exit 4
fi
build=$(step "Build" bash "$root/apps/build.sh" "${build_arguments[@]}" "${quick[@]}" retint) || exit 4
retint=$root/$build/apps/retint

if ((${#arguments[@]} == 0)); then
  workspace=$demo/workspace
  # Made anew with every new build, since the sample may have changed.
  if [[ ! -f $workspace/splat.ply || $retint -nt $workspace/splat.ply ]]; then
    rm -rf "$workspace"
    step "Make a scene" "$retint" synth --output "$workspace" >>"$log" || exit 4
  fi
  mask=$(find "$workspace/masks" -name '*.png' | sort | head -n 1)
  [[ -n $mask ]] || fail "$workspace/masks holds no mask; remove $workspace and run again" 3
  view=${mask#"$workspace/masks/"}
  arguments=("$workspace" --view "${view%.png}" --mask "$mask")
fi
$has_edit || arguments+=(--to "$color")

begin=$SECONDS
"$retint" recolor "${arguments[@]}" --output "$demo/recolored.ply" --report "$demo/report.json" \
  --comparison "$demo/comparison.png" --save-stages "$demo/stages"
printf '%-20s%4d s\n' "Recolor" $((SECONDS - begin)) "In all" $SECONDS >&2
cat <<END

Before, mask and after side by side: $demo/comparison.png
Every view before and after:         $demo/recolored.html
Recolored splat:                     $demo/recolored.ply
Report:                              $demo/report.json
Every stage's files:                 $demo/stages

What to do next:
  Open $demo/recolored.html in a browser, and the splat in any viewer.
  Recolor a scene of yours:
    bash apps/demo.sh SCENE --view NAME --mask M.png --to '$color'
  Build the editor, the Python module and a fully optimized command line:
    bash apps/build.sh
  Read docs/index.md.
END
