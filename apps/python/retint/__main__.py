# SPDX-License-Identifier: BSD-3-Clause
"""python -m retint: the command line."""

import sys

from retint import run_command


def main() -> int:
    return run_command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
