# Functions that every folder's CMakeLists.txt uses, so that each target gets the same warnings and include root.

add_library(diastole_options INTERFACE)
target_include_directories(diastole_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(diastole_options INTERFACE
  -Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor> -Werror)
# GCC 12 takes std::string's short form for an overrun where it inlines a move of one.
target_compile_options(diastole_options INTERFACE
  "$<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-restrict>")

# diastole_prelude(NAME HEADER [PACKAGES fmt::fmt ...] [LIBS x ...])
# Precompiles cmake/preludes/HEADER with the options of this folder. What is declared in this folder from here on, and in
# those below it, begins with these headers; whoever needs one includes it all the same. LIBS hold what the headers only
# declare.
function(diastole_prelude name header)
  cmake_parse_arguments(ARG "" "" "PACKAGES;LIBS" ${ARGN})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Owns precompiled headers.\n")
  add_library(${name} OBJECT ${source})
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  target_link_libraries(${name} PRIVATE diastole_options ${ARG_PACKAGES})
  target_precompile_headers(${name} PRIVATE "\"cmake/preludes/${header}\"")
  set(DIASTOLE_PRELUDE ${name} PARENT_SCOPE)
  set(DIASTOLE_PRELUDE_PACKAGES ${ARG_PACKAGES} PARENT_SCOPE)
  set(DIASTOLE_PRELUDE_LIBS ${ARG_LIBS} PARENT_SCOPE)
endfunction()

# The headers that the folder's prelude precompiles are found, and seen with the same macros, by every target of the folder.
function(diastole_use_prelude name)
  if(DIASTOLE_PRELUDE)
    target_precompile_headers(${name} REUSE_FROM ${DIASTOLE_PRELUDE})
    target_link_libraries(${name} PRIVATE ${DIASTOLE_PRELUDE_LIBS})
    foreach(package IN LISTS DIASTOLE_PRELUDE_PACKAGES)
      target_compile_definitions(${name} PRIVATE $<TARGET_PROPERTY:${package},INTERFACE_COMPILE_DEFINITIONS>)
      target_compile_options(${name} PRIVATE $<TARGET_PROPERTY:${package},INTERFACE_COMPILE_OPTIONS>)
      target_include_directories(${name} SYSTEM PRIVATE $<TARGET_PROPERTY:${package},INTERFACE_INCLUDE_DIRECTORIES>)
    endforeach()
  endif()
endfunction()

# With CMAKE_UNITY_BUILD sources are compiled ten at a time: headers are read and templates made once, which saves half of a
# build from nothing. On in the presets that build everything, off in `debug`, where one changed source is compiled alone.
set(CMAKE_UNITY_BUILD_BATCH_SIZE 10)

# diastole_library(NAME [TOGETHER] SOURCES a.cpp ... [LIBS x ...])
# A static library, or without sources what its headers need; sources are found and included by their path from the root ("protocol/wire/frame.hpp").
# TOGETHER: with every preset its sources are compiled ten at a time, since each alone would mostly compile CLI11 or Asio anew.
function(diastole_library name)
  cmake_parse_arguments(ARG "TOGETHER" "" "SOURCES;LIBS" ${ARGN})
  if(NOT ARG_SOURCES)
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE diastole_options ${ARG_LIBS})
    return()
  endif()
  add_library(${name} STATIC ${ARG_SOURCES})
  if(ARG_TOGETHER)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON)
  endif()
  target_link_libraries(${name} PUBLIC diastole_options ${ARG_LIBS})
  diastole_use_prelude(${name})
endfunction()

# diastole_listed(VARIABLE LIST MACRO)
# The sources that a list of declarations names: NAME.cpp for each of its lines MACRO(..., NAME).
function(diastole_listed variable list macro)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${list})
  file(STRINGS ${list} sources REGEX "^${macro}\\(")
  list(TRANSFORM sources REPLACE "^.*[(, ]([a-z0-9_]+)\\).*" "\\1.cpp")
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

# For what reads, writes and shows text or waits for devices: compiled sooner than with -O3.
set(DIASTOLE_TEXT_OPTIONS $<$<CONFIG:Release>:-O1>)

# diastole_program(NAME SOURCES a.cpp ... [LIBS x ...])  — lands in build/<preset>/bin
function(diastole_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE diastole_options ${ARG_LIBS})
  diastole_use_prelude(${name})
endfunction()

# diastole_embed(VARIABLE HEADER h.hpp NAMESPACE n FILES name=path ...)
# Puts files into the program as string_views of the namespace; VARIABLE becomes the source that defines them. Where the
# tree has no such header, one is made under generated/ of the build.
function(diastole_embed variable)
  cmake_parse_arguments(ARG "" "HEADER;NAMESPACE" "FILES" ${ARGN})
  set(script ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/embedded.cpp)
  string(REPLACE ";" "|" pairs "${ARG_FILES}")
  list(TRANSFORM ARG_FILES REPLACE "^[^=]+=" "" OUTPUT_VARIABLE paths)
  set(declarations "")
  foreach(file IN LISTS ARG_FILES)
    string(REGEX REPLACE "=.*" "" name "${file}")
    string(APPEND declarations "extern const std::string_view ${name};\n")
  endforeach()
  if(NOT EXISTS ${CMAKE_SOURCE_DIR}/${ARG_HEADER})
    file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/${ARG_HEADER} CONTENT
      "#pragma once\n#include <string_view>\nnamespace ${ARG_NAMESPACE} {\n${declarations}}\n")
  endif()
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DHEADER=${ARG_HEADER} -DNAMESPACE=${ARG_NAMESPACE}
            "-DPAIRS=${pairs}" -P ${script}
    DEPENDS ${script} ${paths}
    VERBATIM)
  set(${variable} ${output} PARENT_SCOPE)
endfunction()

# diastole_test(NAME [SERIAL] [OPTIMISED] SOURCES a.cpp ... [LIBS x ...] [LABELS slow ...] [SLOW_CASES Suite.Case ...] [TIMEOUT seconds])
# A GoogleTest program whose cases are single ctest entries; SERIAL: nothing runs beside them. OPTIMISED: its sources make templates
# that the numerics beside them use too, of which the linker takes the test's. Label "slow", of all cases or of some: only in
# `tools/check --full`, and never with sanitizers. Label "threads": also with ThreadSanitizer (preset `tsan`).
function(diastole_test name)
  cmake_parse_arguments(ARG "SERIAL;OPTIMISED" "TIMEOUT" "SOURCES;LIBS;LABELS;SLOW_CASES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE diastole_options ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  if(ARG_OPTIMISED) # not with precompiled headers, which are compiled without
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  else()
    diastole_use_prelude(${name})
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_compile_definitions(${name} PRIVATE
    DIASTOLE_SOURCE_DIR="${CMAKE_SOURCE_DIR}" DIASTOLE_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  if("threads" IN_LIST ARG_LABELS)
    add_dependencies(threaded_tests ${name})
  endif()
  if(CMAKE_BUILD_TYPE STREQUAL "Sanitize" AND "slow" IN_LIST ARG_LABELS)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL TRUE)
    return()
  endif()
  string(JOIN ":" slow_cases ${ARG_SLOW_CASES})
  diastole_add_cases(${name} "-${slow_cases}" "${ARG_LABELS}" "${ARG_SERIAL}" "${ARG_TIMEOUT}")
  if(slow_cases)
    diastole_add_cases(${name} "${slow_cases}" slow "${ARG_SERIAL}" "${ARG_TIMEOUT}")
  endif()
endfunction()

# The cases of a test program that GoogleTest's filter lets pass, as entries of ctest.
function(diastole_add_cases name filter labels serial timeout)
  if(NOT timeout)
    set(timeout 300)
    if("slow" IN_LIST labels)
      set(timeout 1800)
    endif()
  endif()
  set(properties TIMEOUT ${timeout})
  if("slow" IN_LIST labels)
    list(APPEND properties COST ${timeout}) # the longest first: none runs alone at the end
  endif()
  if(serial)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  if(labels)
    list(APPEND properties LABELS "${labels}")
  endif()
  gtest_discover_tests(${name} TEST_PREFIX "${name}." TEST_FILTER "${filter}" PROPERTIES ${properties} DISCOVERY_TIMEOUT 60)
endfunction()
