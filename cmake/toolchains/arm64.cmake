# Builds for arm64 on another architecture: cmake --toolchain cmake/toolchains/arm64.cmake, with the packages
# crossbuild-essential-arm64 and qemu-user-static, and the libraries of packages.txt as :arm64. Programs of the build, such as
# the generator of messages, run by qemu.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
