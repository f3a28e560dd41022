#pragma once
// Adds to a run file that is there, without touching what it holds.

#include <hdf5.h>

#include <filesystem>
#include <functional>
#include <string>

namespace diastole::runfile {

/// `change` gets the open file and says whether it could do what it wanted. It works on a copy beside the file, which is read and
/// checked as a whole and then renamed: the file is whole at every time. Two that amend files of one folder wait for each other.
/// Throws InputError that names `place` if the file cannot be changed, or as read_run does if it no longer is a run file then.
void amend_run(const std::filesystem::path& run, const std::string& place,
               const std::function<bool(hid_t file)>& change);

}  // namespace diastole::runfile
