# Debian packages, by cpack: one for each component of install.cmake, which includes this file. DEVELOPERS.md describes
# them; ./run deb makes them. CMAKE_INSTALL_PREFIX must be /usr: where Debian's libraries are depends on it.
if(NOT BUILD_SHARED_LIBS OR NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  message(FATAL_ERROR "STEPDIAG_DEBIAN_PACKAGES needs BUILD_SHARED_LIBS=ON and CMAKE_INSTALL_PREFIX=/usr, "
                      "got ${BUILD_SHARED_LIBS} and ${CMAKE_INSTALL_PREFIX}")
endif()

# A package belongs to the release of Debian that it is built on, whose libraries it needs: its version says which.
cmake_host_system_information(RESULT debian_release QUERY DISTRIB_VERSION_ID)
cmake_host_system_information(RESULT debian_codename QUERY DISTRIB_VERSION_CODENAME)
set(CPACK_DEBIAN_PACKAGE_RELEASE "1~deb${debian_release}")
set(debian_version "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the stepdiag authors <stepdiag@localhost>")
if(DEFINED ENV{DEBFULLNAME} AND DEFINED ENV{DEBEMAIL}) # who packages, as Debian's tools are told
  set(CPACK_PACKAGE_CONTACT "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(CPACK_COMPONENTS_ALL "")

# The documents of all packages: their copyright, and a change log that refers to the project's.
file(READ LICENSE license)
string(REGEX REPLACE "\n(\n)" "\n.\\1" license "${license}")
string(REGEX REPLACE "\n([^\n])" "\n \\1" license " ${license}")
file(WRITE "${PROJECT_BINARY_DIR}/debian/triggers" "activate-noawait ldconfig\n") # of a package with libraries
string(TIMESTAMP debian_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(cmake/debian/changelog.in debian/changelog @ONLY)
execute_process(COMMAND gzip -9nc debian/changelog WORKING_DIRECTORY "${PROJECT_BINARY_DIR}"
                OUTPUT_FILE debian/changelog.Debian.gz COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND gzip -9nc "${PROJECT_SOURCE_DIR}/CHANGELOG.md" WORKING_DIRECTORY "${PROJECT_BINARY_DIR}"
                OUTPUT_FILE debian/changelog.gz COMMAND_ERROR_IS_FATAL ANY)

# debian_package(COMPONENT NAME SECTION DEPENDS COPYRIGHT DESCRIPTION): DESCRIPTION's first line is the synopsis.
macro(debian_package component name section depends copyright description)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}")
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}")
  if("${section}" STREQUAL "libs")
    set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${PROJECT_BINARY_DIR}/debian/triggers")
  endif()
  configure_file(cmake/debian/${copyright}.in debian/${name}/copyright @ONLY)
  foreach(file ${name}/copyright changelog.Debian.gz changelog.gz)
    install(FILES "${PROJECT_BINARY_DIR}/debian/${file}" DESTINATION share/doc/${name} COMPONENT ${component})
  endforeach()
endmacro()

debian_package(controller libstepdiag-controller${so_version} libs "" copyright
"volumetric compensation for machine tool controllers
The library loads a calibration of a three-axis machine tool once. It then
tells for any position of the axes how far off the tool is, and where the axes
must stand instead. Calls take bounded time and neither allocate nor lock.")
debian_package(controller_dev libstepdiag-controller-dev libdevel
"libstepdiag-controller${so_version} (= ${debian_version})" copyright
"volumetric compensation for controllers: development files
C11 and C++17 headers of the library for controllers, its CMake package
(component controller of stepdiag) and its pkg-config file
(stepdiag-controller).")
if(TARGET stepdiag)
  debian_package(library libstepdiag${so_version} libs
"libstepdiag-controller${so_version} (= ${debian_version})" copyright
"step-diagonal calibration of machine tools
The library simulates and evaluates calibrations of three-axis machine tools
by an interferometer that measures along diagonals of the volume.")
  debian_package(library_dev libstepdiag-dev libdevel
"libstepdiag${so_version} (= ${debian_version}), libstepdiag-controller-dev (= ${debian_version}), libeigen3-dev (>= 3.4)"
copyright
"step-diagonal calibration of machine tools: development files
C++17 headers of the library that simulates and evaluates calibrations, its
CMake package and its pkg-config file (both are named stepdiag).")
endif()
if(STEPDIAG_LINUXCNC_MODULE)
  debian_package(linuxcnc stepdiag-linuxcnc science "linuxcnc-uspace (>= 2.9.0~), python3" copyright-linuxcnc
"volumetric compensation of machine tools in LinuxCNC
The kinematics module stepdiagkins compensates a three-axis machine by a
calibration of stepdiag. With it come the HAL component stepdiag_bridge.py,
which requests readings while a measuring program waits, and a simulated
machine to try both, in /usr/share/stepdiag-linuxcnc.")
  foreach(linked csv md) # into the module, statically
    install(FILES /usr/share/doc/lib${linked}-dev/copyright DESTINATION share/doc/stepdiag-linuxcnc
            RENAME copyright.lib${linked} COMPONENT linuxcnc)
  endforeach()
endif()
include(CPack)
