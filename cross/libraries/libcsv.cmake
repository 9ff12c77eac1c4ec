# Of libcsv: the library alone.
cmake_minimum_required(VERSION 3.25)
project(libcsv LANGUAGES C)
file(READ csv.h header)
string(REGEX MATCHALL "csv_[a-z0-9_]+\\(" names "${header}") # and nothing of the compiler's own
list(TRANSFORM names REPLACE "\\(" "")
list(REMOVE_DUPLICATES names)
list(JOIN names "\n" names)
file(WRITE "${PROJECT_BINARY_DIR}/csv.def" "EXPORTS\n${names}\n")
add_library(csv SHARED libcsv.c "${PROJECT_BINARY_DIR}/csv.def")
install(TARGETS csv)
install(FILES csv.h TYPE INCLUDE)
