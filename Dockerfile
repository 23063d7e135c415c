# Millpond's service on Mesa's software driver, or on a GPU whose driver the container runtime brings.
#
#   docker build -t millpond .
#   docker run --rm -p 8000:8000 -v millpond:/data -e MILLPOND_API_KEYS='["a secret"]' millpond
#   docker run ... --read-only --tmpfs /tmp ... millpond        the root may be read-only
#   docker run --rm millpond doctor                             what drawing needs, and what of it is here
#
# Where packages come from a mirror, hand pip its configuration; it leaves no trace in the image:
#   docker build --secret id=pip.conf,src=pip.conf -t millpond .

ARG BASE=debian:bookworm-slim

# ---- what both stages stand on: Debian's Python 3.11, and EGL with Mesa's drivers; no X server
FROM ${BASE} AS base
RUN apt-get update \
 && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
      python3 tini libegl1 libopengl0 libegl-mesa0 libgl1-mesa-dri \
 && rm -rf /var/lib/apt/lists/*

# ---- the packages, exactly those of the lock, and the project in place
FROM base AS build
RUN apt-get update \
 && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends ca-certificates python3-venv \
 && rm -rf /var/lib/apt/lists/*
WORKDIR /opt/millpond
COPY requirements.txt ./
RUN --mount=type=secret,id=pip.conf,target=/etc/pip.conf \
    python3 -m venv .venv \
 && .venv/bin/pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements.txt
COPY . .
# Compiled here because a read-only root cannot be written to later; by hash, because a layer may change times.
RUN .venv/bin/pip install --no-cache-dir --disable-pip-version-check --no-deps --no-build-isolation --no-index -e . \
 && .venv/bin/python -m compileall -q --invalidation-mode unchecked-hash renderer service .venv/lib

# ---- what runs
FROM base
RUN groupadd --system --gid 10001 millpond \
 && useradd --system --uid 10001 --gid millpond --home-dir /data --shell /usr/sbin/nologin millpond \
 && install --directory --owner millpond --group millpond --mode 750 /data
COPY --from=build /opt/millpond /opt/millpond
ENV PATH=/opt/millpond/.venv/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    MALLOC_ARENA_MAX=2 \
    MILLPOND_DATA_DIR=/data/state \
    MILLPOND_CACHE=/data/cache \
    MESA_SHADER_CACHE_DIR=/data/cache/mesa
USER millpond
WORKDIR /data
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
# The first start bakes the scene into /data/cache, which can take a minute on a small machine; later ones find it there.
HEALTHCHECK --interval=10s --timeout=5s --start-period=180s --retries=3 \
  CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/readyz', timeout=4)"]
# A real init: it reaps workers and hands SIGTERM on.
ENTRYPOINT ["/usr/bin/tini", "--", "millpond"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8000"]
