# What is installed: libraries, headers, CMake package and pkg-config file. Included by CMakeLists.txt.
set(config_dir "${CMAKE_INSTALL_LIBDIR}/cmake/stepdiag")

# Two sets, so that who uses the controller's library alone needs nothing that the other one does.
install(TARGETS stepdiag_controller EXPORT stepdiagControllerTargets INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT stepdiagControllerTargets NAMESPACE stepdiag:: DESTINATION "${config_dir}")
if(TARGET stepdiag)
  install(TARGETS stepdiag EXPORT stepdiagTargets INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT stepdiagTargets NAMESPACE stepdiag:: DESTINATION "${config_dir}")
  install(DIRECTORY cpp/include/ DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
else()
  install(DIRECTORY cpp/include/stepdiag/controller cpp/include/stepdiag/machine
          DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/stepdiag")
  foreach(header axis error rotation units)
    install(FILES cpp/include/stepdiag/core/${header}.hpp DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/stepdiag/core")
  endforeach()
endif()
install(DIRECTORY "${PROJECT_BINARY_DIR}/include/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")

configure_package_config_file(cmake/stepdiagConfig.cmake.in stepdiagConfig.cmake INSTALL_DESTINATION "${config_dir}")
write_basic_package_version_file(stepdiagConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/stepdiagConfig.cmake" "${PROJECT_BINARY_DIR}/stepdiagConfigVersion.cmake"
              cmake/FindLibCsv.cmake cmake/FindLibMd.cmake DESTINATION "${config_dir}")

# A C program that links the archive has to name what the archive needs; the shared library brings it along.
set(needed_by_archive "-lcsv -lmd -lstdc++ -lm")
if(BUILD_SHARED_LIBS)
  set(pkg_config_libs "")
  set(pkg_config_libs_private "${needed_by_archive}")
else()
  set(pkg_config_libs " ${needed_by_archive}")
  set(pkg_config_libs_private "")
endif()
file(RELATIVE_PATH prefix_from_file "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/") # the installation may be moved
configure_file(cmake/stepdiag-controller.pc.in stepdiag-controller.pc @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/stepdiag-controller.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
