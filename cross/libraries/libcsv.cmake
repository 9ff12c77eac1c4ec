# Of libcsv: the library alone.
cmake_minimum_required(VERSION 3.25)
project(libcsv LANGUAGES C)
add_library(csv SHARED libcsv.c)
set_target_properties(csv PROPERTIES WINDOWS_EXPORT_ALL_SYMBOLS ON)
install(TARGETS csv)
install(FILES csv.h TYPE INCLUDE)
