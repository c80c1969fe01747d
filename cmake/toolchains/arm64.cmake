# Builds for arm64 on another architecture: cmake --toolchain cmake/toolchains/arm64.cmake, with the packages of kind "arm64"
# and the libraries of packages.txt as :arm64 (tools/build arm64). Programs of the build, such as the generator of messages,
# run by qemu.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
find_program(DOPPEL_EMULATOR NAMES qemu-aarch64-static qemu-aarch64 REQUIRED)  # the name is that of the release
set(CMAKE_CROSSCOMPILING_EMULATOR ${DOPPEL_EMULATOR})
# Otherwise CMake's FindOpenSSL, which Fast DDS needs, asks pkg-config for the libraries of this machine.
set(ENV{PKG_CONFIG_LIBDIR} /usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
