# The server and the command line in one image, Envoy and the viewer in another (--target web). The steps are those of the
# README, by the same scripts. For another kind of machine (--platform linux/arm64, or linux/amd64 on arm64) they are compiled on this
# one, and only the packages of the images are installed in emulation. Needs BuildKit or Buildah (deploy/one.md).

FROM --platform=$BUILDPLATFORM debian:13 AS build
ARG TARGETARCH
WORKDIR /src
COPY deploy deploy
RUN deploy/install --for "$TARGETARCH" build run
COPY . .
RUN if [ "$(dpkg --print-architecture)" = "$TARGETARCH" ]; then deploy/up --server-only --build-only; else \
    cmake --preset release --toolchain "deploy/$TARGETARCH.cmake" && cmake --build --preset release --target lpdeform-server lpdeform; fi

FROM --platform=$BUILDPLATFORM debian:13 AS build-web
ARG TARGETARCH
WORKDIR /src
COPY deploy deploy
COPY client/web/package.json client/web/package-lock.json client/web/
COPY client/web/client/package.json client/web/client/
COPY client/web/viewer/package.json client/web/viewer/
RUN deploy/install --for "$TARGETARCH" web
COPY proto proto
COPY client/web client/web
RUN PATH=/src/build/web-tools/bin:$PATH npm run build --prefix client/web

FROM --platform=$TARGETPLATFORM debian:13 AS web
COPY deploy/install deploy/packages.txt /opt/lpdeform/deploy/
RUN /opt/lpdeform/deploy/install web-run && rm -rf /var/lib/apt/lists/* && \
    groupadd --gid 10001 lpdeform && useradd --uid 10001 --gid 10001 --no-create-home --shell /usr/sbin/nologin lpdeform
WORKDIR /opt/lpdeform
COPY LICENSE /usr/share/doc/lpdeform/
COPY deploy/web deploy/envoy-config deploy/envoy.yaml.in deploy/
COPY --from=build-web /src/build/web-tools/envoy/_bin/envoy build/web-tools/bin/envoy
COPY --from=build-web /src/client/web/viewer/dist client/web/viewer/dist
USER 10001:10001
EXPOSE 8080 8081
HEALTHCHECK --interval=15s --timeout=5s --start-period=10s \
  CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/8081 && printf 'GET /healthz HTTP/1.1\\r\\nHost: lpdeform\\r\\nConnection: close\\r\\n\\r\\n' >&3 && grep -q ^ok <&3"]
ENTRYPOINT ["deploy/web", "--health", "0.0.0.0:8081"]
CMD ["--web", "0.0.0.0:8080", "--server", "lpdeform:50051"]

FROM --platform=$TARGETPLATFORM debian:13
COPY deploy/install deploy/packages.txt /opt/lpdeform/deploy/
RUN /opt/lpdeform/deploy/install run && rm -rf /var/lib/apt/lists/* && \
    groupadd --gid 10001 lpdeform && useradd --uid 10001 --gid 10001 --no-create-home --shell /usr/sbin/nologin lpdeform
COPY LICENSE /usr/share/doc/lpdeform/
COPY --from=build /src/build/release/bin/lpdeform-server /src/build/release/bin/lpdeform /usr/local/bin/
USER 10001:10001
EXPOSE 50051 9464
HEALTHCHECK --interval=15s --timeout=5s --start-period=10s CMD ["lpdeform-server", "--healthcheck", "http://127.0.0.1:9464"]
ENTRYPOINT ["lpdeform-server"]
CMD ["--address", "0.0.0.0:50051", "--admin-address", "0.0.0.0:9464", "--allow-anonymous"]
