# SPDX-License-Identifier: MIT
# Headers and package files of the components. Targets are installed where they are defined (bevel_component()).
include(CMakePackageConfigHelpers)
install(DIRECTORY core/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)  # exceptions, used by every component
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/bevel)
foreach(component IN LISTS BEVEL_ALL_COMPONENTS)
  if(NOT BEVEL_WITH_${component})
    continue()
  endif()
  install(EXPORT bevel-${component}-targets NAMESPACE bevel:: DESTINATION ${package_folder} COMPONENT dev)
  if(component STREQUAL camera)  # a folder of the module drivers
    install(DIRECTORY drivers/include/bevel/drivers/camera DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/bevel/drivers
      COMPONENT dev)
    if(BEVEL_WITH_sim)
      install(DIRECTORY rig/include/bevel/rig/camera DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/bevel/rig COMPONENT dev)
    endif()
  else()
    install(DIRECTORY ${folder_of_${component}}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
      PATTERN camera EXCLUDE)
  endif()
endforeach()

set(bevel_component_needs "")  # for bevelConfig.cmake
foreach(component IN LISTS BEVEL_ALL_COMPONENTS)
  string(APPEND bevel_component_needs "set(bevel_needs_${component} \"${BEVEL_NEEDS_${component}}\")\n")
endforeach()
configure_package_config_file(cmake/bevelConfig.cmake.in ${PROJECT_BINARY_DIR}/bevelConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/bevelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/bevelConfig.cmake ${PROJECT_BINARY_DIR}/bevelConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT dev)

# Files that installed programs read (tools/common/shipped_file.cpp).
if(BEVEL_BUILD_TOOLS)
  install(FILES config/demo.toml config/beam.toml DESTINATION ${CMAKE_INSTALL_DATADIR}/bevel/config COMPONENT tools)
  install(FILES tools/replay/strict.toml DESTINATION ${CMAKE_INSTALL_DATADIR}/bevel/tools/replay COMPONENT tools)
endif()

# Debian packages: cpack -G DEB. Shared libraries in libbevel0.1, headers and package files in libbevel-dev, programs in
# bevel-tools. Dependencies on shared libraries come from dpkg-shlibdeps, which needs LCM from Debian (BEVEL_SYSTEM_LCM).
if(PROJECT_IS_TOP_LEVEL)
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_NAME bevel)
  set(CPACK_PACKAGE_CONTACT "Bevel project <bevel@localhost>")
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
  set(CPACK_COMPONENTS_ALL dev)
  set(runtime_package libbevel${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME ${runtime_package})
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_DEV_PACKAGE_NAME libbevel-dev)
  set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
  set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME bevel-tools)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
  # The packages of others that the headers and the package files of the built components need.
  set(debian_of_model libeigen3-dev)
  set(debian_of_diagnosis libceres-dev)
  set(debian_of_camera libopencv-dev libceres-dev libeigen3-dev)
  set(debian_of_io liblcm-dev libssl-dev zlib1g-dev libzstd-dev liblz4-dev pkg-config)
  set(needs "")
  foreach(component IN LISTS BEVEL_ALL_COMPONENTS)
    if(BEVEL_WITH_${component})
      list(APPEND needs ${debian_of_${component}})
    endif()
  endforeach()
  if(BUILD_SHARED_LIBS)
    list(APPEND CPACK_COMPONENTS_ALL runtime)
    list(APPEND needs "${runtime_package} (= ${PROJECT_VERSION})")
    set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "${runtime_package} (= ${PROJECT_VERSION})")
  endif()
  if(BEVEL_BUILD_TOOLS)
    list(APPEND CPACK_COMPONENTS_ALL tools)
  endif()
  list(REMOVE_DUPLICATES needs)
  list(JOIN needs ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)
  include(CPack)
endif()
