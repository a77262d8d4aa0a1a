# Libraries, all from Debian; scripts/install-dependencies.sh installs them.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(BZip2 REQUIRED)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(CJSON REQUIRED IMPORTED_TARGET libcjson)
pkg_check_modules(EPOXY REQUIRED IMPORTED_TARGET epoxy)
pkg_check_modules(EGL REQUIRED IMPORTED_TARGET egl)
pkg_check_modules(URING REQUIRED IMPORTED_TARGET liburing)
pkg_check_modules(CMOCKA IMPORTED_TARGET cmocka)
# Not find_package: its CMake files want OpenCV headers that nothing here uses.
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO)
list(APPEND CMAKE_MODULE_PATH /usr/lib/x86_64-linux-gnu/cmake/OpenVDB /usr/lib/aarch64-linux-gnu/cmake/OpenVDB)
find_package(OpenVDB REQUIRED)
# Debian's own Python, for the plain second reader and the independent counts used by the tests.
find_program(TRIP_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
# Debian's libnifti2-dev has neither pkg-config nor CMake files.
find_path(NIFTI_INCLUDE_DIR nifti2_io.h PATH_SUFFIXES nifti REQUIRED)
find_library(NIFTI_LIBRARY nifti2 REQUIRED)
add_library(trip_nifti INTERFACE)
target_include_directories(trip_nifti SYSTEM INTERFACE ${NIFTI_INCLUDE_DIR})
target_link_libraries(trip_nifti INTERFACE ${NIFTI_LIBRARY})
