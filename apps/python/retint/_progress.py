# SPDX-License-Identifier: BSD-3-Clause
"""A progress bar for a whole run, in plain text."""

import sys
import time
from typing import Dict, List, Optional, TextIO, Tuple

# The stages that a call goes through, in order, and about how long each takes of the whole.
_STAGES: Dict[str, List[Tuple[str, float]]] = {
    "open": [("load", 1)],
    "select": [("depth", 8), ("cloud", 2), ("registration", 2)],
    "project": [("completion", 15), ("completion", 2), ("projection", 15), ("completion", 2),
                ("projection", 8)],
    "add_region": [("shares", 8)],
    "refit": [("refit", 30)],
    "match": [("match", 15)],
    "evaluate": [("evaluate", 15)],
    "write_splat": [("save", 2)],
}
_WIDTH = 28


class ProgressBar:
    """What progress_bar() returns: a callable of a stage's name and its fraction."""

    def __init__(self, calls: Tuple[str, ...], file: Optional[TextIO]) -> None:
        unknown = [call for call in calls if call not in _STAGES]
        if unknown:
            raise ValueError(f"there is no call '{unknown[0]}'; there are {', '.join(_STAGES)}")
        self._plan = [stage for call in calls for stage in _STAGES[call]]
        self._file = file
        self._begin()

    def _begin(self) -> None:
        self._next = 0  # in the plan, after the stage under way
        self._stage, self._stage_fraction = "", 0.0
        self._fraction = 0.0  # of the whole; it never falls
        self._started = time.monotonic()
        self._shown = -1  # whole percent

    def __call__(self, stage: str, fraction: float) -> None:
        if all(stage != name for name, _ in self._plan):
            return
        # Back at its beginning, a stage comes another time. Threads may overtake each other by less.
        comes = stage != self._stage or fraction + 0.5 < self._stage_fraction
        if comes and self._fraction == 1:
            self._begin()  # of a run after the one that ended
        if comes:
            ahead = [i for i in range(self._next, len(self._plan)) if self._plan[i][0] == stage]
            if not ahead:
                return  # oftener than planned
            self._next = ahead[0] + 1
        self._stage, self._stage_fraction = stage, fraction
        done = sum(weight for _, weight in self._plan[:self._next - 1])
        done += self._plan[self._next - 1][1] * fraction
        self._fraction = max(self._fraction, done / sum(weight for _, weight in self._plan))
        self._show()

    def _show(self) -> None:
        file = sys.stderr if self._file is None else self._file
        percent = int(100 * self._fraction)
        on_terminal = file.isatty()
        step = 1 if on_terminal else 10  # a line each ten percent, where lines stay
        if percent // step == self._shown // step and percent < 100 or percent == self._shown:
            return
        self._shown = percent
        seconds = time.monotonic() - self._started
        if self._fraction == 1:
            time_left = f"done in {_duration(seconds)}"
        elif self._fraction > 0.02:
            left = seconds * (1 - self._fraction) / self._fraction
            time_left = f"{self._stage}, about {_duration(left)} left"
        else:
            time_left = self._stage
        bar = "=" * int(_WIDTH * self._fraction)
        line = f"[{bar:{_WIDTH}}] {percent:3} %  {time_left}"
        if on_terminal:
            file.write("\r\033[K" + line + ("\n" if self._fraction == 1 else ""))
        else:
            file.write(line + "\n")
        file.flush()


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 60 else f"{seconds // 60:.0f}:{seconds % 60:02.0f} min"


def progress_bar(*calls: str, file: Optional[TextIO] = None) -> ProgressBar:
    """A bar for the `progress` of several calls, with one total and the time left.

    Name the calls of your run in order: 'open', 'select', 'project', 'add_region', 'refit',
    'evaluate', 'write_splat'. Without names it is a run of select, project, refit and evaluate.
    Give a call the same bar as the others:

        bar = retint.progress_bar()
        masks = session.project(session.select(painted, progress=bar), progress=bar)
        ...
        session.refit(progress=bar)
        session.evaluate(region, progress=bar)

    Name 'select' once for each painted view and 'refit' once for each region. After the end of a run
    the bar begins another one. `file`: the stream to draw to; standard error by default.
    """
    return ProgressBar(calls or ("select", "project", "refit", "evaluate"), file)
