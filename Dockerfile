# The same steps as on a fresh machine, as a user without privileges.
# FootFall listens on 127.0.0.1 only, so run the container in the host's network:
#   docker build -t footfall . && docker run --rm --network host footfall
# The base image by digest, so that every build begins with the same; to take a newer one, look at
#   docker buildx imagetools inspect python:3.11-slim-bookworm
FROM python:3.11-slim-bookworm@sha256:528257d48c1da0dcecc2e725d1ae34498d60c965f1241e39cd6a85a8859bdf84
RUN apt-get update && apt-get install -y --no-install-recommends make && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home operator
USER operator
WORKDIR /home/operator/footfall
COPY --chown=operator:operator . .
RUN make .venv/.run
EXPOSE 8080
HEALTHCHECK --start-period=120s --interval=30s --timeout=10s CMD [".venv/bin/python", "-c", \
  "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8080/health/live', timeout=8)"]
CMD ["make", "run"]
