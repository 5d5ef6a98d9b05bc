# One image for every process of a run: docker-compose.yml says which process a container is.
FROM python:3.13-slim
WORKDIR /app
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY network network
COPY nodes nodes
COPY sim sim
RUN pip install --no-cache-dir --constraint constraints.txt .
COPY scenarios scenarios
ENV ZENOH_RUNTIME="(rx: (worker_threads: 1))" OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
ENTRYPOINT ["dcpf"]
