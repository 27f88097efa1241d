# The same steps as on a fresh machine, as a user without privileges.
# FootFall listens on 127.0.0.1 only, so run the container in the host's network:
#   docker build -t footfall . && docker run --rm --network host footfall
FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends make && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home operator
USER operator
WORKDIR /home/operator/footfall
COPY --chown=operator:operator . .
RUN make .venv/.run
EXPOSE 8080
CMD ["make", "run"]
