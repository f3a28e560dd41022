#include "protocol/runfile/note_writer.hpp"

#include <fmt/format.h>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/runfile/amended_file.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::runfile {
namespace {

TypeHandle text_type() {
  TypeHandle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

bool write_attribute(hid_t object, const char* name, const std::string& value) {
  const TypeHandle type = text_type();
  const SpaceHandle scalar(H5Screate(H5S_SCALAR));
  const AttributeHandle attribute(
      H5Acreate2(object, name, type.get(), scalar.get(), H5P_DEFAULT, H5P_DEFAULT));
  const char* text = value.c_str();
  return attribute.valid() && H5Awrite(attribute.get(), type.get(), &text) >= 0;
}

/// The first number that no note has.
size_t free_number(hid_t file) {
  size_t number = 1;
  if (H5Lexists(file, session_group, H5P_DEFAULT) <= 0 || H5Lexists(file, session_notes, H5P_DEFAULT) <= 0)
    return number;
  while (H5Lexists(file, note_path(number).c_str(), H5P_DEFAULT) > 0)
    ++number;
  return number;
}

bool write_note(hid_t file, const SessionNote& note) {
  const TypeHandle type = text_type();
  const SpaceHandle scalar(H5Screate(H5S_SCALAR));
  const DatasetHandle dataset = create_dataset(file, note_path(free_number(file)), type.get(), scalar);
  const char* text = note.text.c_str();
  return dataset.valid() && H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0 &&
         write_attribute(dataset.get(), "units", text_unit) &&
         write_attribute(dataset.get(), note_written, note.written_utc) &&
         write_attribute(dataset.get(), note_author, note.author);
}

}  // namespace

std::string note_path(size_t number) { return fmt::format("{}/{:04}", session_notes, number); }

void append_note(const std::filesystem::path& run, const SessionNote& note) {
  if (note.text.find_first_not_of(" \t\n") == std::string::npos)
    throw InputError({run.string(), "note", "has no text", "Say what is to be remembered."});
  for (const auto& [place, text] : {std::pair("note", &note.text), std::pair("author", &note.author)}) {
    if (const std::string why = why_not_plain(*text); !why.empty())
      throw InputError({run.string(), place, why, "Write it in UTF-8, without control characters."});
  }
  (void)open_run(run);
  amend_run(run, fmt::format("group {}", session_notes), [&](hid_t file) { return write_note(file, note); });
}

}  // namespace diastole::runfile
