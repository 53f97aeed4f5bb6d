# SPDX-License-Identifier: BSD-3-Clause
# The command line on Debian 12, for the CPU:
#   docker build -t retint .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" retint info WS
# Each compiler process takes up to 2 GB: pass --build-arg JOBS=1 if memory is short.
FROM debian:12 AS build
WORKDIR /retint
COPY apps/setup.sh apps/
RUN bash apps/setup.sh --for demo file
COPY . .
ARG JOBS
RUN cmake -S . -B build/image -G Ninja -DCMAKE_BUILD_TYPE=Release -DRETINT_UNPACKED=/retint/build/unpacked \
      -DRETINT_CUDA=OFF -DRETINT_MPI=OFF -DRETINT_PYTHON=OFF -DRETINT_TESTS=OFF -DRETINT_VIEWER=OFF \
    && cmake --build build/image -j "${JOBS:-$(nproc)}" \
    && cd build/image && cpack -G DEB -D CPACK_COMPONENTS_ALL=cli -B packages

FROM debian:12-slim
# apt installs the libraries that the package depends on, and nothing to compile with.
RUN --mount=type=bind,from=build,source=/retint/build/image/packages,target=/packages \
    apt-get -q update && apt-get -q install -y --no-install-recommends /packages/*.deb && rm -rf /var/lib/apt/lists/*
# The cache of a user without a home.
ENV HOME=/tmp
WORKDIR /work
ENTRYPOINT ["retint"]
CMD ["--help"]
