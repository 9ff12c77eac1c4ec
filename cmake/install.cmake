# What is installed: libraries, headers, CMake package, pkg-config files and self-tests. Included by CMakeLists.txt.
set(config_dir "${CMAKE_INSTALL_LIBDIR}/cmake/stepdiag")
set(pkg_config_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

# install_library(TARGET COMPONENT EXPORT): what programs need is in COMPONENT, what their build needs in COMPONENT_dev.
function(install_library target component export)
  install(TARGETS ${target}
          EXPORT ${export}
          LIBRARY COMPONENT ${component} NAMELINK_COMPONENT ${component}_dev
          ARCHIVE COMPONENT ${component}_dev
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT ${export} NAMESPACE stepdiag:: DESTINATION "${config_dir}" COMPONENT ${component}_dev)
endfunction()

# Two sets, so that who uses the controller's library alone needs nothing that the other one does.
install_library(stepdiag_controller controller stepdiagControllerTargets)
install(DIRECTORY cpp/include/stepdiag/controller cpp/include/stepdiag/machine
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/stepdiag" COMPONENT controller_dev)
foreach(header axis error rotation units)
  install(FILES cpp/include/stepdiag/core/${header}.hpp
          DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/stepdiag/core" COMPONENT controller_dev)
endforeach()
install(DIRECTORY "${PROJECT_BINARY_DIR}/include/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT controller_dev)
if(TARGET stepdiag)
  install_library(stepdiag library stepdiagTargets)
  install(DIRECTORY cpp/include/ DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT library_dev
          REGEX "/stepdiag/(controller|machine|core/(axis|error|rotation|units)\\.hpp)$" EXCLUDE)
endif()

# The self-tests, beside the headers: packages of several versions of a shared library may be installed together.
set(known python/stepdiag/selftest/known)
set(known_dir "${CMAKE_INSTALL_DATADIR}/stepdiag/selftest")
if(TARGET stepdiag-controller-selftest)
  install(TARGETS stepdiag-controller-selftest RUNTIME COMPONENT controller_dev)
  install(FILES ${known}/compensator.csv ${known}/compensator_table.csv DESTINATION "${known_dir}"
          COMPONENT controller_dev)
endif()
if(TARGET stepdiag-selftest)
  install(TARGETS stepdiag-selftest RUNTIME COMPONENT library_dev)
  foreach(run clean misaligned)
    install(FILES ${known}/runs/${run}/measurement.csv ${known}/runs/${run}/truth.csv
            DESTINATION "${known_dir}/runs/${run}" COMPONENT library_dev)
  endforeach()
endif()

configure_package_config_file(cmake/stepdiagConfig.cmake.in stepdiagConfig.cmake INSTALL_DESTINATION "${config_dir}")
write_basic_package_version_file(stepdiagConfigVersion.cmake COMPATIBILITY ${compatibility})
install(FILES "${PROJECT_BINARY_DIR}/stepdiagConfig.cmake" "${PROJECT_BINARY_DIR}/stepdiagConfigVersion.cmake"
              cmake/FindLibCsv.cmake cmake/FindLibMd.cmake DESTINATION "${config_dir}" COMPONENT controller_dev)

# A C program that links the archive has to name what the archive needs; the shared library brings it along.
set(needed_by_archive "-lcsv -lmd -lstdc++ -lm")
if(BUILD_SHARED_LIBS)
  set(pkg_config_libs "")
  set(pkg_config_libs_private "${needed_by_archive}")
else()
  set(pkg_config_libs " ${needed_by_archive}")
  set(pkg_config_libs_private "")
endif()
file(RELATIVE_PATH prefix_from_file "/${pkg_config_dir}" "/") # the installation may be moved

# install_pkg_config(NAME COMPONENT)
function(install_pkg_config name component)
  configure_file(cmake/${name}.pc.in ${name}.pc @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/${name}.pc" DESTINATION "${pkg_config_dir}" COMPONENT ${component})
endfunction()
install_pkg_config(stepdiag-controller controller_dev)
if(TARGET stepdiag AND BUILD_SHARED_LIBS) # an archive needs Embree and Highway, which find_package knows
  install_pkg_config(stepdiag library_dev)
endif()

if(STEPDIAG_LINUXCNC_MODULE)
  install(FILES "${STEPDIAG_LINUXCNC_MODULE}" DESTINATION lib/linuxcnc/modules COMPONENT linuxcnc)
  # The simulated machine finds the bridge beside its folder, also in a copy of both.
  install(FILES controllers/linuxcnc/stepdiag_bridge.py DESTINATION share/stepdiag-linuxcnc COMPONENT linuxcnc)
  install(DIRECTORY controllers/linuxcnc/simulated DESTINATION share/stepdiag-linuxcnc COMPONENT linuxcnc
          PATTERN .gitignore EXCLUDE PATTERN "linuxcnc.var*" EXCLUDE)
endif()
if(STEPDIAG_DEBIAN_PACKAGES)
  include(cmake/debian/packages.cmake)
endif()
