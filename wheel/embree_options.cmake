# How wheels build Embree: static, on the oldest instructions, with triangles and no TBB: a scene has a few dozen
# triangles, and one thread builds its tree.
set(embree_options -DEMBREE_STATIC_LIB:BOOL=ON -DEMBREE_TASKING_SYSTEM:STRING=INTERNAL)
foreach(without ISPC_SUPPORT TUTORIALS RAY_PACKETS FILTER_FUNCTION)
  list(APPEND embree_options -DEMBREE_${without}:BOOL=OFF)
endforeach()
foreach(geometry QUAD CURVE SUBDIVISION USER INSTANCE GRID POINT)
  list(APPEND embree_options -DEMBREE_GEOMETRY_${geometry}:BOOL=OFF)
endforeach()
