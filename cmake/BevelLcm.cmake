# SPDX-License-Identifier: MIT
# Finds LCM and defines bevel_lcm_bindings(). Two sources of LCM: the PyPI wheel under .deps/lcm (default; headers, liblcm,
# lcm-gen, lcm.jar, Python), or Debian's liblcm-dev, liblcm-bin and liblcm-java. Defines the target bevel_lcm.
option(BEVEL_SYSTEM_LCM "Use the system's liblcm even where .deps/lcm exists" OFF)
set(lcm_wheel ${PROJECT_SOURCE_DIR}/.deps/lcm)
if(EXISTS ${lcm_wheel}/lib/lcm/cmake/lcmConfig.cmake AND NOT BEVEL_SYSTEM_LCM)
  set(BEVEL_LCM_ROOT ${lcm_wheel})
  find_library(LCM_LIBRARY lcm PATHS ${lcm_wheel}/lib NO_DEFAULT_PATH REQUIRED)
  find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp PATHS ${lcm_wheel}/include NO_DEFAULT_PATH REQUIRED)
  find_program(LCM_GEN lcm-gen PATHS ${lcm_wheel}/bin NO_DEFAULT_PATH REQUIRED)
  find_file(LCM_JAR lcm.jar PATHS ${lcm_wheel}/share/java NO_DEFAULT_PATH)
else()
  set(BEVEL_LCM_ROOT "")
  find_library(LCM_LIBRARY lcm REQUIRED)
  find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
  find_program(LCM_GEN lcm-gen REQUIRED)
  find_file(LCM_JAR lcm.jar PATHS /usr/share/java)
endif()
message(STATUS "LCM: ${LCM_LIBRARY}")
add_library(bevel_lcm INTERFACE)
target_include_directories(bevel_lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
target_link_libraries(bevel_lcm INTERFACE ${LCM_LIBRARY})
if(BEVEL_SANITIZE STREQUAL "address")
  # LCM calls handlers through pointers to members, for which GCC up to 12 checks the type of the wrong address.
  target_compile_options(bevel_lcm INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fno-sanitize=vptr>)
endif()

# bevel_lcm_bindings(TARGET FILES...): C++ headers (target TARGET), a jar (TARGET_jar, build/lcmtypes/TARGET.jar) and
# a Python package (build/lcmtypes/python). A target that uses the types links TARGET.
function(bevel_lcm_bindings target)
  set(out ${PROJECT_BINARY_DIR}/lcmtypes)
  set(headers "")
  set(java "")
  foreach(file ${ARGN})
    get_filename_component(stem ${file} NAME_WE)
    string(REGEX REPLACE "^bevel_" "" type ${stem})
    list(APPEND sources ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    list(APPEND headers ${out}/cpp/bevel/${type}.hpp)
    list(APPEND java ${out}/java/bevel/${type}.java)
  endforeach()
  # lcm-gen -p appends to __init__.py, so the Python package is made anew.
  add_custom_command(OUTPUT ${headers} ${java} ${out}/python/bevel/__init__.py DEPENDS ${sources}
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${out}/python ${out}/java
    COMMAND ${LCM_GEN} -x --cpp-hpath ${out}/cpp -j --jpath ${out}/java -p --ppath ${out}/python ${sources}
    COMMENT "lcm-gen: C++, Java and Python types" VERBATIM)
  add_custom_target(${target}_generated DEPENDS ${headers} ${java})
  add_library(${target} INTERFACE)
  add_library(bevel::lcmtypes ALIAS ${target})
  add_dependencies(${target} ${target}_generated)
  target_include_directories(${target} SYSTEM INTERFACE "$<BUILD_INTERFACE:${out}/cpp>"
    "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  # The installed package finds LCM on the user's machine (bevelConfig.cmake).
  target_link_libraries(${target} INTERFACE "$<BUILD_INTERFACE:bevel_lcm>" "$<INSTALL_INTERFACE:bevel::lcm>")
  set_target_properties(${target} PROPERTIES EXPORT_NAME lcmtypes)
  install(TARGETS ${target} EXPORT bevel-io-targets)
  install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/bevel COMPONENT dev)
  install(FILES ${sources} DESTINATION ${CMAKE_INSTALL_DATADIR}/bevel/lcmtypes COMPONENT dev)

  find_program(JAVAC javac)
  find_program(JAR jar)
  if(JAVAC AND JAR AND LCM_JAR)
    add_custom_command(OUTPUT ${out}/${target}.jar DEPENDS ${java}
      COMMAND ${CMAKE_COMMAND} -E rm -rf ${out}/classes
      COMMAND ${CMAKE_COMMAND} -E make_directory ${out}/classes
      COMMAND ${JAVAC} -nowarn -cp ${LCM_JAR} -d ${out}/classes ${java}
      COMMAND ${JAR} cf ${out}/${target}.jar -C ${out}/classes .
      COMMENT "jar of the LCM types" VERBATIM)
    add_custom_target(${target}_jar ALL DEPENDS ${out}/${target}.jar)
  else()
    message(STATUS "No javac, jar or lcm.jar: bevel-spy will not be built")
  endif()
endfunction()
