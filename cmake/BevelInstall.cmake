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

configure_package_config_file(cmake/bevelConfig.cmake.in ${PROJECT_BINARY_DIR}/bevelConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/bevelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/bevelConfig.cmake ${PROJECT_BINARY_DIR}/bevelConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT dev)
