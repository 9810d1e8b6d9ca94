# Where .github/workflows/wheels.yaml builds the wheels of client/python: Debian 12 with the Pythons of a manylinux image.
ARG ARCH=x86_64
FROM quay.io/pypa/manylinux_2_34_${ARCH} AS pythons
FROM debian:12
COPY deploy/install deploy/packages.txt /deploy/
RUN mkdir /build && apt-get update -qq && apt-get install --yes -qq --no-install-recommends \
    $(awk '/^\[/ {inside = ($0 == "[python]"); next} inside && NF && !/^#/ && !/ of /' /deploy/packages.txt)
COPY --from=pythons /opt/python /opt/python
COPY --from=pythons /opt/_internal /opt/_internal
