# After cpack has made the package of the programs: that of the Python package beside it.
execute_process(
  COMMAND ${CPACK_DIASTOLE_SOURCE_DIR}/packaging/python_package ${CPACK_DIASTOLE_SOURCE_DIR} ${CPACK_PACKAGE_VERSION}
          ${CPACK_PACKAGE_DIRECTORY}
  COMMAND_ERROR_IS_FATAL ANY)
