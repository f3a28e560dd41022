# What makes a mistake in the programs harder to use: checked copies and containers, guarded stacks, tables that are read-only before the first
# line runs, code at addresses of its own. In release and package; the sanitizers have checks of their own. A test looks for
# each in the finished programs (tests/packaging/hardened.py).
if(NOT CMAKE_BUILD_TYPE STREQUAL "Release")
  return()
endif()
include(CheckCXXCompilerFlag)
set(CMAKE_REQUIRED_FLAGS -Werror)  # clang only warns of options that this processor lacks

add_compile_options(-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3 -fstack-protector-strong -fPIE)
add_compile_definitions(_GLIBCXX_ASSERTIONS)  # an index or iterator outside its container ends the program
foreach(option
    -fstack-clash-protection
    -fcf-protection              # x86: indirect branches and returns go where they may (CET)
    -mbranch-protection=standard # Arm: the same
  )
  string(MAKE_C_IDENTIFIER "takes${option}" takes)
  check_cxx_compiler_flag(${option} ${takes})
  if(${takes})
    add_compile_options(${option})
  endif()
endforeach()
add_link_options("$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>" -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack)
# No folder to look for libraries in: CMake's list of them ends with an empty one, which is wherever the program is started.
set(CMAKE_SKIP_RPATH ON)
