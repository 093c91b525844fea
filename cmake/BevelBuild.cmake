# SPDX-License-Identifier: MIT
# Compiler settings and the functions that define every target of the project:
#   bevel_component()  an installed library of the public API, bevel::NAME
#   bevel_library()    an internal static library of tools/, tests/, proof/, report/ and view/
#   bevel_program()    an executable in build/bin
#   bevel_test()       a GoogleTest program
include(GNUInstallDirs)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

option(BUILD_SHARED_LIBS "Build shared instead of static libraries" OFF)
option(BEVEL_WERROR "Treat compiler warnings as errors" OFF)
set(BEVEL_SANITIZE "" CACHE STRING "Sanitizers: address (with undefined behaviour), thread, or empty for none")
set_property(CACHE BEVEL_SANITIZE PROPERTY STRINGS "" address thread)
option(BEVEL_FUZZ "Build tests/fuzz against libFuzzer, with the sanitizers of BEVEL_SANITIZE (clang)" OFF)
option(BEVEL_TIDY "Run clang-tidy with every compilation" OFF)

# A parent project keeps its own choice of these.
if(PROJECT_IS_TOP_LEVEL)
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  set(CMAKE_INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
  set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)  # the LCM wheel is outside the linker's default path
  if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release)
  endif()
  find_program(CCACHE ccache)
  if(CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  endif()
endif()

# Warnings and sanitizers. Every target links this privately, so that no user of a library inherits them.
add_library(bevel_flags INTERFACE)
target_compile_options(bevel_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  -Wold-style-cast -Woverloaded-virtual -Wnull-dereference $<$<BOOL:${BEVEL_WERROR}>:-Werror>)
# GCC 12 at -O3 reports null dereferences and uninitialised memory inside Eigen's vectorised paths, and overlapping
# copies inside std::string (GCC bug 105651). These reports are wrong.
target_compile_options(bevel_flags INTERFACE
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference;-Wno-maybe-uninitialized;-Wno-restrict>")
if(BEVEL_SANITIZE)  # OFF, in old build folders, means none
  # GCC runs without the checks of alignment and of null at every member access: they double its time on Eigen, and up to
  # GCC 12 they report correct calls through pointers to members. The address sanitizer reports a null pointer that is
  # dereferenced, and the fuzz targets, compiled by clang, have all checks.
  set(flags_for_address -fsanitize=address,undefined -fno-sanitize-recover=all
    $<$<CXX_COMPILER_ID:GNU>:-fno-sanitize=null,alignment>)
  set(flags_for_thread -fsanitize=thread)
  if(NOT DEFINED flags_for_${BEVEL_SANITIZE})
    message(FATAL_ERROR "BEVEL_SANITIZE is '${BEVEL_SANITIZE}'; allowed: address, thread, or empty")
  endif()
  target_compile_options(bevel_flags INTERFACE ${flags_for_${BEVEL_SANITIZE}} -fno-omit-frame-pointer)
  target_link_options(bevel_flags INTERFACE ${flags_for_${BEVEL_SANITIZE}})
endif()
if(BEVEL_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
    message(FATAL_ERROR "BEVEL_FUZZ needs clang++ (libFuzzer), this is ${CMAKE_CXX_COMPILER_ID}")
  endif()
  target_compile_options(bevel_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(BEVEL_TIDY)
  find_program(CLANG_TIDY NAMES clang-tidy clang-tidy-14 REQUIRED)
  # clang-tidy reads GCC's command lines, which contain warnings that only GCC has.
  set(CMAKE_CXX_CLANG_TIDY ${CLANG_TIDY} --quiet --extra-arg=-Wno-unknown-warning-option)
endif()

# For tools/, tests/ and proof/, whose headers are included by their path from the project's root.
add_library(bevel_options INTERFACE)
target_link_libraries(bevel_options INTERFACE bevel_flags)
target_include_directories(bevel_options INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/core/include)

# bevel_component(NAME SOURCES files... [COMPONENT name] [PUBLIC libs...] [PRIVATE libs...] [BUILD libs...]):
# library bevel_NAME with the alias bevel::NAME, static or shared by BUILD_SHARED_LIBS, installed and exported with
# COMPONENT (default: NAME). Public headers are in include/, all other files in src/. PUBLIC: its headers include these
# libraries. PRIVATE: only its sources do. BUILD: header-only libraries that only its sources include, which the
# installed package therefore does not need.
function(bevel_component name)
  cmake_parse_arguments(arg "" "COMPONENT" "SOURCES;PUBLIC;PRIVATE;BUILD" ${ARGN})
  if(NOT arg_COMPONENT)
    set(arg_COMPONENT ${name})
  endif()
  add_library(bevel_${name} ${arg_SOURCES})
  add_library(bevel::${name} ALIAS bevel_${name})
  target_compile_features(bevel_${name} PUBLIC cxx_std_20)
  target_include_directories(bevel_${name}
    PUBLIC "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>"
      "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/core/include>"  # bevel/error.hpp
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(bevel_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:bevel_flags>)
  foreach(library IN LISTS arg_BUILD)
    target_link_libraries(bevel_${name} PRIVATE $<BUILD_INTERFACE:${library}>)
  endforeach()
  # Before 1.0 a minor version may change the ABI.
  set_target_properties(bevel_${name} PROPERTIES EXPORT_NAME ${name} VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} DEFINE_SYMBOL "")
  install(TARGETS bevel_${name} EXPORT bevel-${arg_COMPONENT}-targets
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()

# bevel_library(NAME SOURCES... [LINK libs...]): internal static library bevel_NAME, not installed.
function(bevel_library name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_library(bevel_${name} STATIC ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(bevel_${name} PUBLIC ${arg_LINK} PRIVATE bevel_options)
endfunction()

# bevel_program(NAME SOURCES... [LINK libs...]): an executable in build/bin. Programs for users are named bevel-* and are
# installed.
function(bevel_program name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE bevel_options ${arg_LINK})
  target_compile_definitions(${name} PRIVATE BEVEL_VERSION="${PROJECT_VERSION}")
  if(name MATCHES "^bevel-")
    set_property(GLOBAL APPEND PROPERTY BEVEL_PROGRAMS ${name})
    install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
  endif()
  if(name MATCHES "^(bench|study)_" AND BEVEL_SANITIZE)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)  # no test runs them in a sanitized build
  endif()
endfunction()

# bevel_test(NAME SOURCES... [LINK libs...] [LABELS labels...]): a GoogleTest program; ctest lists each of its tests.
# Label `long`: more than 10 s in all. Every other test without the label `slow` has the label `fast`.
# Label `threads`: the tests start threads of this project's code, so the thread sanitizer runs them (preset tsan).
add_custom_target(threaded_tests)
set(BEVEL_TEST_TIMEOUT 300)
if(BEVEL_SANITIZE)
  set(BEVEL_TEST_TIMEOUT 1500)  # sanitized code is five to fifteen times slower
endif()
function(bevel_test name)
  cmake_parse_arguments(arg "" "" "LINK;LABELS" ${ARGN})
  if(NOT arg_LABELS MATCHES "slow|long|nightly|processes|can|beam")
    list(APPEND arg_LABELS fast)
  endif()
  add_executable(test_${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(test_${name} PRIVATE bevel_options ${arg_LINK} GTest::gmock GTest::gtest_main)
  target_compile_definitions(test_${name} PRIVATE BEVEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    BEVEL_BINARY_DIR="${PROJECT_BINARY_DIR}")
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${BEVEL_TEST_TIMEOUT} LABELS "${arg_LABELS}")
  if("threads" IN_LIST arg_LABELS)
    add_dependencies(threaded_tests test_${name})
  endif()
endfunction()
