#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Copies a program with Open MPI to FOLDER, from where both run on a machine that has no MPI, or from any other place:
#     bash apps/carry_mpi.sh PROGRAM FOLDER
#     FOLDER/mpirun -n 2 FOLDER/PROGRAM ...
# FOLDER/include has mpi.h, to build against: -DMPI_C_HEADER_DIR=FOLDER/include -DMPI_C_LIB_NAMES=mpi -DMPI_mpi_LIBRARY=FOLDER/lib/libmpi.so.40
# With --all, every library goes along that the program loads, but for those of the C library and of the driver.
set -euo pipefail
all=0
if [[ ${1:-} == --all ]]; then all=1; shift; fi
if (($# != 2)); then echo "usage: carry_mpi.sh [--all] PROGRAM FOLDER" >&2; exit 2; fi
program=$1 folder=$2

mpirun=$(readlink -f "$(command -v mpirun)")
plugins=$(ompi_info --path pkglibdir --parsable | cut -d: -f3)
data=$(ompi_info --path pkgdatadir --parsable | cut -d: -f3)
settings=$(ompi_info --path sysconfdir --parsable | cut -d: -f3)
mkdir -p "$folder"/{bin,lib,plugins,data,settings}
folder=$(cd "$folder" && pwd)
cp "$mpirun" "$folder/bin/orterun"
cp "$(dirname "$mpirun")/orted" "$folder/bin/"
cp "$program" "$folder/"
cp "$plugins"/*.so "$folder/plugins/"
cp "$data"/*.txt "$folder/data/"
header=$(ompi_info --path incdir --parsable | cut -d: -f3)
if [[ -f $header/mpi.h ]]; then mkdir -p "$folder/include" && cp "$header"/mpi*.h "$folder/include/"; fi
cp "$settings"/* "$folder/settings/" 2>/dev/null || true

# What they load, the plugins' PMIx among it: of Open MPI and what it is built on.
loaded() { ldd "$@" 2>/dev/null | awk '$3 ~ /^\// { print $3 }' | sort -u; }
wanted='/lib(mpi|mca_common_\w+|open-rte|open-pal|hwloc|event_core|event_pthreads|pmix|munge|udev|z|numa|ltdl)[.-]'
if ((all)); then wanted='/lib(?!c\.|m\.|pthread|dl\.|rt\.|resolv\.|cuda\.)[^/]*$'; fi
{ loaded "$folder/bin/orterun" "$folder"/plugins/*.so; loaded "$program"; } | sort -u | grep -P "$wanted" |
  xargs -I{} cp -L {} "$folder/lib/"

cat > "$folder/mpirun" <<'MPIRUN'
#!/bin/sh
# Starts Open MPI from where this file lies.
here=$(cd "$(dirname "$0")" && pwd)
export OPAL_PREFIX="$here" OPAL_BINDIR="$here/bin" OPAL_LIBDIR="$here/lib" OPAL_PKGLIBDIR="$here/plugins"
export OPAL_PKGDATADIR="$here/data" OPAL_SYSCONFDIR="$here/settings"
export LD_LIBRARY_PATH="$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
exec "$here/bin/orterun" -q -x LD_LIBRARY_PATH -x OPAL_PREFIX -x OPAL_LIBDIR -x OPAL_PKGLIBDIR -x OPAL_PKGDATADIR -x OPAL_SYSCONFDIR "$@"
MPIRUN
chmod +x "$folder/mpirun"
