#pragma once
// Notes that are written into a run file after the run: /session/notes/<number>. None of those that are there is ever changed,
// and neither is anything else.

#include <filesystem>
#include <string>

#include "protocol/runfile/session.hpp"

namespace diastole::runfile {

/// The dataset of the n-th note, from 1: "/session/notes/0001".
std::string note_path(size_t number);

/// As amend_run (amended_file.hpp). Throws InputError as read_run does, for a note without text, and for a text or an author that is not plain
/// (protocol/contract/plain_text.hpp).
void append_note(const std::filesystem::path& run, const SessionNote& note);

}  // namespace diastole::runfile
