# Cross-compiles for x86-64 on Debian for arm64: cmake --preset release --toolchain deploy/amd64.cmake
# deploy/install --for amd64 build installs what it needs. protoc and the plugin of gRPC are those of this machine.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER x86_64-linux-gnu-g++)
set(PKG_CONFIG_EXECUTABLE x86_64-linux-gnu-pkg-config)
