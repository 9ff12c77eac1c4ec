# Of libmd: SHA-2 alone.
cmake_minimum_required(VERSION 3.25)
project(libmd LANGUAGES C)
file(WRITE "${PROJECT_BINARY_DIR}/config.h" "")
file(WRITE "${PROJECT_BINARY_DIR}/sys/endian.h" "")
add_library(md STATIC src/sha2.c)
target_include_directories(md PRIVATE include "${PROJECT_BINARY_DIR}")
install(TARGETS md)
install(FILES include/sha2.h TYPE INCLUDE)
