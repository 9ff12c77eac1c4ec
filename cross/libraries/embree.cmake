# Read by Embree's project(): it sets CMAKE_CXX_FLAGS itself. Templates are looked into where they are used: two that are
# not print members that they have not. Its warnings are not ours.
add_compile_options(-D_USE_MATH_DEFINES -fdelayed-template-parsing -w)
