# Compiler settings and the three functions with which every target of the project is made.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

set(BEVEL_SANITIZE "" CACHE STRING "Sanitizers to build with: address (with undefined behaviour), thread, or none (empty)")
set_property(CACHE BEVEL_SANITIZE PROPERTY STRINGS "" address thread)
option(BEVEL_FUZZ "Build tests/fuzz against libFuzzer, with the sanitizers of BEVEL_SANITIZE (clang)" OFF)
option(BEVEL_TIDY "Run clang-tidy with every compilation" OFF)

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(bevel_options INTERFACE)
target_compile_options(bevel_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  -Wold-style-cast -Woverloaded-virtual -Wnull-dereference -Werror)
# GCC 12 at -O3 sees null dereferences and uninitialised reads inside Eigen's vectorised paths, and overlapping copies
# inside std::string (GCC bug 105651), that are not there.
target_compile_options(bevel_options INTERFACE
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference;-Wno-maybe-uninitialized;-Wno-restrict>")
target_include_directories(bevel_options INTERFACE ${CMAKE_SOURCE_DIR})
if(BEVEL_SANITIZE)  # OFF, of folders configured before there was a choice, is none
  # GCC without the checks of alignment and of null at every member access: they double its time on Eigen, and up to
  # GCC 12 they report calls through pointers to members that are right. The address sanitizer sees a null that is
  # followed, and the fuzz targets, by clang, have all checks.
  set(flags_for_address -fsanitize=address,undefined -fno-sanitize-recover=all
    $<$<CXX_COMPILER_ID:GNU>:-fno-sanitize=null,alignment>)
  set(flags_for_thread -fsanitize=thread)
  if(NOT DEFINED flags_for_${BEVEL_SANITIZE})
    message(FATAL_ERROR "BEVEL_SANITIZE is '${BEVEL_SANITIZE}'; allowed: address, thread, or empty")
  endif()
  target_compile_options(bevel_options INTERFACE ${flags_for_${BEVEL_SANITIZE}} -fno-omit-frame-pointer)
  target_link_options(bevel_options INTERFACE ${flags_for_${BEVEL_SANITIZE}})
endif()
if(BEVEL_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
    message(FATAL_ERROR "BEVEL_FUZZ needs clang++ (libFuzzer), this is ${CMAKE_CXX_COMPILER_ID}")
  endif()
  target_compile_options(bevel_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(BEVEL_TIDY)
  find_program(CLANG_TIDY NAMES clang-tidy clang-tidy-14 REQUIRED)
  # It reads GCC's command lines, in which some warnings are GCC's own.
  set(CMAKE_CXX_CLANG_TIDY ${CLANG_TIDY} --quiet --extra-arg=-Wno-unknown-warning-option)
endif()

# bevel_library(NAME SOURCES... [LINK libs...]): target bevel_NAME; with no sources a header-only one.
function(bevel_library name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS)
    add_library(bevel_${name} STATIC ${arg_UNPARSED_ARGUMENTS})
    target_link_libraries(bevel_${name} PUBLIC bevel_options ${arg_LINK})
  else()
    add_library(bevel_${name} INTERFACE)
    target_link_libraries(bevel_${name} INTERFACE bevel_options ${arg_LINK})
  endif()
endfunction()

# bevel_program(NAME SOURCES... [LINK libs...]): an executable in build/bin. Those that users call are named bevel-*.
function(bevel_program name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE bevel_options ${arg_LINK})
  target_compile_definitions(${name} PRIVATE BEVEL_VERSION="${PROJECT_VERSION}")
  if(name MATCHES "^bevel-")
    set_property(GLOBAL APPEND PROPERTY BEVEL_PROGRAMS ${name})
  endif()
  if(name MATCHES "^(bench|study)_" AND BEVEL_SANITIZE)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)  # nothing runs them there
  endif()
endfunction()

# bevel_test(NAME SOURCES... [LINK libs...] [LABELS labels...]): a GoogleTest program; ctest lists each of its tests.
# Label `threads`: the tests run several threads of ours, so the thread sanitizer has to see them (preset tsan).
add_custom_target(threaded_tests)
set(BEVEL_TEST_TIMEOUT 300)
if(BEVEL_SANITIZE)
  set(BEVEL_TEST_TIMEOUT 1500)  # five to fifteen times slower
endif()
function(bevel_test name)
  cmake_parse_arguments(arg "" "" "LINK;LABELS" ${ARGN})
  add_executable(test_${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(test_${name} PRIVATE bevel_options ${arg_LINK} GTest::gmock GTest::gtest_main)
  target_compile_definitions(test_${name} PRIVATE BEVEL_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    BEVEL_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${BEVEL_TEST_TIMEOUT} LABELS "${arg_LABELS}")
  if("threads" IN_LIST arg_LABELS)
    add_dependencies(threaded_tests test_${name})
  endif()
endfunction()
