# The studio in a container: docker build -t kinetostat . ; how to run it is in docs/install.md.

FROM python:3.13-slim-bookworm AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE pins.txt ./
COPY src src
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels . && mv pins.txt /wheels

FROM python:3.13-slim-bookworm
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    pip install --no-cache-dir --require-hashes --requirement /wheels/pins.txt && \
    pip install --no-cache-dir --no-deps /wheels/kinetostat-*.whl
RUN useradd --create-home --uid 10001 kinetostat && install --directory --owner kinetostat /data
USER kinetostat
WORKDIR /data
VOLUME /data
EXPOSE 8080
HEALTHCHECK --interval=30s --timeout=5s --start-period=30s \
    CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8080/', timeout=4)"]
ENTRYPOINT ["kinetostat"]
CMD ["studio", "--host", "0.0.0.0", "--port", "8080", "--state", "/data", "--no-browser"]
