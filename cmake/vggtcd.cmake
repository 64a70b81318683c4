# SPDX-License-Identifier: Apache-2.0
# The three functions every CMakeLists.txt of this project is written with.
include(GNUInstallDirs)

find_program(VGGTCD_CCACHE ccache)
if(VGGTCD_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${VGGTCD_CCACHE})
endif()

# The one place for warnings and sanitizers.
# -ffp-contract=off: a result must not depend on whether the compiler fused a multiply and an add.
function(vggtcd_compile_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion -Werror
                                           -ffp-contract=off
                         # GCC 12 sees an overlap in "text" + std::string (its bug 105651).
                         $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(VGGTCD_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${VGGTCD_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize-recover=all -g1)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # With sanitizers g++ 12 takes Eigen's plain assignments for reads of uninitialised memory.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
    # The static libraries are linked into programs that know nothing of this option.
    target_link_options(${target} PUBLIC -fsanitize=${VGGTCD_SANITIZE})
  endif()
endfunction()

# vggtcd_module(ROOM SOURCES a.cc ... [DEPS other_rooms_and_libs ...] [PRIVATE_DEPS ...] [INTERNAL a.h ...])
# One static library vggtcd_ROOM, alias vggtcd::ROOM, installed and exported with its headers, but for the INTERNAL ones,
# which no other room includes.
function(vggtcd_module room)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPS;PRIVATE_DEPS;INTERNAL" ${ARGN})
  add_library(vggtcd_${room} STATIC ${arg_SOURCES})
  add_library(vggtcd::${room} ALIAS vggtcd_${room})
  set_target_properties(vggtcd_${room} PROPERTIES EXPORT_NAME ${room})
  target_include_directories(vggtcd_${room} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(vggtcd_${room} PUBLIC ${arg_DEPS} PRIVATE ${arg_PRIVATE_DEPS})
  vggtcd_compile_options(vggtcd_${room})
  install(TARGETS vggtcd_${room} EXPORT vggtcdTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  set(internal)
  foreach(header ${arg_INTERNAL})
    list(APPEND internal PATTERN ${header} EXCLUDE)
  endforeach()
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vggtcd/${room}
          FILES_MATCHING PATTERN "*.h" ${internal})
endfunction()

# Time limits of tests, in seconds. They are for hangs: an order above what a slow laptop takes while it does other things.
set(VGGTCD_LIMIT_UNIT 1800)
set(VGGTCD_LIMIT_E2E 10800)
set(VGGTCD_LIMIT_WEIGHTS 21600)

# vggtcd_test(NAME SOURCES a_test.cc ... [DEPS ...] [LABELS unit] [TIMEOUT ${VGGTCD_LIMIT_UNIT}])
# One GoogleTest program; every TEST in it becomes a ctest test of that label.
# The tests see VGGTCD_SOURCE_DIR, the root of the checkout, for golden data.
# The target unit_tests builds those labelled unit and nothing else.
function(vggtcd_test name)
  if(NOT VGGTCD_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;DEPS;LABELS" ${ARGN})
  if(NOT arg_LABELS)
    set(arg_LABELS unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT ${VGGTCD_LIMIT_UNIT})
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
  # Only where it is used: the compiler cache then serves the other tests from any checkout.
  foreach(source ${arg_SOURCES})
    file(STRINGS ${source} uses_source_dir REGEX "VGGTCD_SOURCE_DIR|tests/support/.*\\.h" LIMIT_COUNT 1)
    if(uses_source_dir)
      set_property(SOURCE ${source} APPEND PROPERTY
                   COMPILE_DEFINITIONS VGGTCD_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
    endif()
  endforeach()
  target_link_libraries(${name} PRIVATE ${arg_DEPS} GTest::gmock GTest::gtest_main)
  vggtcd_compile_options(${name})
  if("unit" IN_LIST arg_LABELS)
    if(NOT TARGET unit_tests)
      add_custom_target(unit_tests)
    endif()
    add_dependencies(unit_tests ${name})
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST
    PROPERTIES LABELS "${arg_LABELS}" TIMEOUT ${arg_TIMEOUT})
endfunction()

# vggtcd_isa(FILE avx2|avx512|avx512bf16): compile one kernel file for an instruction set.
# Such a file is reached only through run-time dispatch. It includes no Eigen and defines nothing
# inline outside an unnamed namespace: the linker keeps one copy of an inline function, and it must
# not be one that an older processor cannot run.
function(vggtcd_isa file isa)
  set(avx2 -mavx2 -mfma -mf16c)
  set(avx512 ${avx2} -mavx512f -mavx512bw -mavx512dq -mavx512vl -mprefer-vector-width=512)
  set(avx512bf16 ${avx512} -mavx512bf16)
  set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "${${isa}}")
endfunction()
