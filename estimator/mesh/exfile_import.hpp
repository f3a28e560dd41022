#pragma once
// Reads exnode and exelem files (CMISS, cmgui, OpenCMISS; version 1 of the EX format) into a mesh. What is read and
// what is refused: docs/mesh-file.md.

#include <string>
#include <string_view>
#include <vector>

#include "estimator/mesh/mesh_file.hpp"

namespace diastole {

/// A file's content under the name that messages call it.
struct NamedText {
  std::string_view text;
  std::string file;
};

struct ImportedMesh {
  MeshBody body;
  std::vector<std::string> remarks;  ///< what a person should know of it, a sentence each
};

/// `mm_per_unit` is the length that a coordinate of 1 stands for. Throws InputError.
ImportedMesh import_exfiles(const NamedText& exnode, const NamedText& exelem, double mm_per_unit);

}  // namespace diastole
