# Cross-compiles for arm64 on Debian: cmake --preset release --toolchain deploy/arm64.cmake
# deploy/install --for arm64 build for-arm64-test installs what it needs, with qemu-user for the tests. protoc and the plugin of gRPC
# are those of this machine.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(PKG_CONFIG_EXECUTABLE aarch64-linux-gnu-pkg-config)
set(CMAKE_CROSSCOMPILING_EMULATOR /usr/bin/qemu-aarch64)
