# Writes a C++ file that holds each file of PAIRS ("name=path", separated by |) as a string_view of its namespace.
#   cmake -DOUTPUT=embedded.cpp -DHEADER=host/web/embedded.hpp -DNAMESPACE=diastole::web::embedded
#         -DPAIRS="page_css=page.css|page_js=page.js" -P embed_files.cmake
set(text "#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n")
string(REPLACE "|" ";" pairs "${PAIRS}")
foreach(pair IN LISTS pairs)
  string(REGEX MATCH "^([^=]+)=(.+)$" _ "${pair}")
  set(name "${CMAKE_MATCH_1}")
  file(READ "${CMAKE_MATCH_2}" hex HEX)
  string(LENGTH "${hex}" digits)
  math(EXPR bytes "${digits} / 2")
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," list "${hex}")
  string(APPEND text "static constexpr char ${name}_bytes[] = {${list}};\n"
    "const std::string_view ${name}(${name}_bytes, ${bytes});\n")
endforeach()
string(APPEND text "}\n")
file(WRITE "${OUTPUT}" "${text}")
