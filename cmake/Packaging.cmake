# The Debian package: `cmake --preset release && cmake --build --preset release && cpack --config
# build/release/CPackConfig.cmake` makes build/release/diastole_VERSION_ARCH.deb, with the images of
# build/firmware if the preset `firmware` has been built, and python3-diastole_VERSION_all.deb beside it.

set(DIASTOLE_FIRMWARE_IMAGES ${CMAKE_SOURCE_DIR}/build/firmware/bin CACHE PATH "Images that the package carries")
set(packaging ${CMAKE_SOURCE_DIR}/packaging)
set(staged ${CMAKE_BINARY_DIR}/packaging)

# The service's rig file is the documented example with the places that a system service has.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/examples/rig.toml)
file(READ ${CMAKE_SOURCE_DIR}/examples/rig.toml service_rig)
foreach(change
    [==[# socket = "/run/diastole.sock"=>socket = "/run/diastole/daemon.sock"]==]
    [==[journal_dir = "journals"        #=>journal_dir = "/var/lib/diastole/journals" #]==]
    [==[# control_group = "diastole"=>control_group = "diastole"]==])
  string(REGEX MATCH "^(.*)=>(.*)$" matched "${change}")
  set(from "${CMAKE_MATCH_1}")
  set(to "${CMAKE_MATCH_2}")
  string(FIND "${service_rig}" "${from}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "examples/rig.toml no longer holds: ${from}")
  endif()
  string(REPLACE "${from}" "${to}" service_rig "${service_rig}")
endforeach()
file(WRITE ${staged}/rig.toml "${service_rig}")

file(READ ${CMAKE_SOURCE_DIR}/LICENSE licence)
file(WRITE ${staged}/copyright "${licence}")
file(GLOB vendored ${CMAKE_SOURCE_DIR}/third_party/*/LICENSE)
foreach(file IN LISTS vendored)
  file(READ ${file} licence)
  file(RELATIVE_PATH name ${CMAKE_SOURCE_DIR} ${file})
  file(APPEND ${staged}/copyright "\n---- ${name}\n\n${licence}")
endforeach()

install(TARGETS diastole sim_rig RUNTIME DESTINATION bin)
install(FILES ${packaging}/diastole-daemon.service DESTINATION lib/systemd/system)
install(FILES ${packaging}/60-diastole.rules DESTINATION lib/udev/rules.d)
install(FILES ${packaging}/sysusers.conf DESTINATION lib/sysusers.d RENAME diastole.conf)
install(FILES ${staged}/rig.toml DESTINATION /etc/diastole)
install(DIRECTORY ${DIASTOLE_FIRMWARE_IMAGES}/ DESTINATION share/diastole/firmware OPTIONAL
        FILES_MATCHING PATTERN "*.bin" PATTERN "*.hex" PATTERN "*.image")
# What the programs are made of, of which versions: libraries that they load, headers that were compiled in.
set(materials ${CMAKE_BINARY_DIR}/diastole.cdx.json)
file(GLOB vendored_pages CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/third_party/*/README.md)
add_custom_command(OUTPUT ${materials}
  COMMAND /usr/bin/python3 -B ${packaging}/bill_of_materials --version ${PROJECT_VERSION} --build ${CMAKE_BINARY_DIR}
          --vendored ${CMAKE_SOURCE_DIR}/third_party -o ${materials} $<TARGET_FILE:diastole> $<TARGET_FILE:sim_rig>
  DEPENDS diastole sim_rig ${packaging}/bill_of_materials ${vendored_pages} COMMENT "Bill of materials" VERBATIM)
add_custom_target(bill_of_materials ALL DEPENDS ${materials})

install(FILES README.md ${staged}/copyright ${materials} DESTINATION share/doc/diastole)
install(DIRECTORY docs/ DESTINATION share/doc/diastole/docs FILES_MATCHING PATTERN "*.md" PATTERN "*.svg" PATTERN "*.png")
install(DIRECTORY examples DESTINATION share/doc/diastole)
install(FILES ${packaging}/diastole.completion DESTINATION share/bash-completion/completions RENAME diastole)
install(CODE "
  set(root \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share\")
  file(MAKE_DIRECTORY \"\${root}/man/man1\")
  foreach(program diastole sim_rig)
    execute_process(COMMAND ${packaging}/manual_page ${PROJECT_VERSION}
                            \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/\${program}\"
                            \"\${root}/man/man1/\${program}.1.gz\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  execute_process(COMMAND ${packaging}/command_pages ${PROJECT_VERSION}
                          \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/diastole\" \"\${root}/man/man1\" COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND gzip -9nc ${packaging}/changelog
                  OUTPUT_FILE \"\${root}/doc/diastole/changelog.gz\" COMMAND_ERROR_IS_FATAL ANY)")

set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME diastole)
set(CPACK_PACKAGE_CONTACT "The Diastole authors <diastole@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "soft-tissue mechanics in the MR scanner: pump, acquisition, estimation")
set(CPACK_PACKAGE_DESCRIPTION
  "Diastole drives a stepper piston pump that inflates a soft specimen in
an MR scanner, records the pressure, and finds the specimen's material law
from the load and the imaged motion. The package holds the programs, the
acquisition daemon as a service, and the controller's firmware.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR OFF)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "systemd, udev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  ${packaging}/postinst ${packaging}/prerm ${packaging}/postrm ${packaging}/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DIASTOLE_SOURCE_DIR ${CMAKE_SOURCE_DIR})
set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/python_package.cmake)
include(CPack)
