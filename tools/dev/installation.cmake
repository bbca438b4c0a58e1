# `cmake --install`: the program with manual, completions and documents, and the modules as libraries for
# find_package(hexcal). `cpack`: the same as Debian packages hexcal, libhexcal-dev and
# python3-hexcal.

# Headers and documents keep the folders of the source, so that includes and links hold.
foreach(folder kinematics photogrammetry camera_calib pose_extract calibration tools/io tools/campaign)
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hexcal/${folder} COMPONENT development
          FILES_MATCHING PATTERN "*.h")
endforeach()
install(FILES README.md CONVENTIONS.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program RENAME copyright)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libhexcal-dev COMPONENT development RENAME copyright)
file(GLOB documents RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS */*.md tools/*/*.md tools/hexcal/flow.svg samples/report.png)
list(FILTER documents EXCLUDE REGEX "^build/")
foreach(document IN LISTS documents)
  get_filename_component(folder ${document} DIRECTORY)
  install(FILES ${document} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder} COMPONENT program)
endforeach()
install(PROGRAMS tools/dev/demo.sh DESTINATION ${CMAKE_INSTALL_DOCDIR}/tools/dev COMPONENT program)

include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/hexcal)
install(EXPORT hexcal-targets NAMESPACE hexcal:: DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(tools/dev/hexcal-config.cmake.in ${PROJECT_BINARY_DIR}/hexcal-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hexcal-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hexcal-config.cmake ${PROJECT_BINARY_DIR}/hexcal-config-version.cmake
        DESTINATION ${package_folder} COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "hexcal maintainers <hexcal@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME hexcal)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
    "calibration of a Stewart platform by photographs
 Three photographs per pose of printed square markers go in, the poses with
 standard deviations, the identified machine and corrected commands come out.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libhexcal-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
# What hexcal-config.cmake looks for and the libraries link.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libapriltag-dev, libcairo2-dev, libceres-dev, libeigen3-dev, libexiv2-dev, libfmt-dev, libjpeg-dev, \
libopencv-dev, libheif-dev, libpcl-dev, libraw-dev, libssl-dev, libtbb-dev, libyaml-cpp-dev, nlohmann-json3-dev, pkg-config")
if(HEXCAL_BUILD_PYTHON)
  math(EXPR python_next "${Python_VERSION_MINOR} + 1")
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-hexcal)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/tools/python/debian/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), \
python3 (<< ${Python_VERSION_MAJOR}.${python_next}~), python3-numpy")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
      "calibration of a Stewart platform by photographs (Python module)
 Kinematics, measurement, identification and compensation on numpy arrays.")
endif()
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "calibration of a Stewart platform by photographs (libraries)
 Static libraries and headers of hexcal's modules, for find_package(hexcal).")
include(CPack)
