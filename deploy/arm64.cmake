# Cross-compiles for arm64 on Debian: cmake --preset release --toolchain deploy/arm64.cmake
# Needs crossbuild-essential-arm64, the -dev packages of group build for arm64, and qemu-user for the tests; tests/machines --arm64
# installs all of it. protoc and the plugin of gRPC are those of this machine.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(PKG_CONFIG_EXECUTABLE aarch64-linux-gnu-pkg-config)
set(CMAKE_CROSSCOMPILING_EMULATOR /usr/bin/qemu-aarch64)
