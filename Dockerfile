# The server and the command line in one image. The steps are those of the README, by the same scripts.

FROM debian:12 AS build
WORKDIR /src
COPY deploy deploy
RUN deploy/install build run
COPY . .
RUN deploy/up --server-only --build-only

FROM debian:12
COPY deploy/install deploy/packages.txt /opt/lpdeform/deploy/
RUN /opt/lpdeform/deploy/install run && rm -rf /var/lib/apt/lists/* && \
    groupadd --gid 10001 lpdeform && useradd --uid 10001 --gid 10001 --no-create-home --shell /usr/sbin/nologin lpdeform
COPY LICENSE /usr/share/doc/lpdeform/
COPY --from=build /src/build/release/bin/lpdeform-server /src/build/release/bin/lpdeform /usr/local/bin/
USER 10001:10001
EXPOSE 50051
HEALTHCHECK --interval=15s --timeout=5s --start-period=10s CMD ["lpdeform-server", "--healthcheck", "127.0.0.1:50051"]
ENTRYPOINT ["lpdeform-server"]
CMD ["--address", "0.0.0.0:50051"]
