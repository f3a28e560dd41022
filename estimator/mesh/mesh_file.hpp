#pragma once
// A body's mesh as a text file, NAME.mesh.toml (format "diastole-mesh", version 1): nodes with their derivatives,
// elements, named faces, fibre angles. docs/mesh-file.md is the page for users. What is written comes back to
// the last bit.
//
//   [[node]]  # 1                                                    numbered from 1 in the file's order
//   x_mm = [value, d1, d2, d12, d3, d13, d23, d123]                  likewise y_mm, z_mm
//   fibre_deg = 60.0     sheet_deg = 0.0   transverse_deg = 0.0      optional; for all nodes or for none
//   zero = ["d1", "d13"]                                             optional: zero in every field (collapsed edge)
//   shares = ["value 3", "d3 3"]                                     optional: the same as node 3's, in every field
//   [[element]]  # 1
//   nodes = [1, 2, 5, 6, 9, 10, 13, 14]                              corner b1 + 2 b2 + 4 b3 (hermite_mesh.hpp)
//   faces = ["inner xi3=0", "top xi2=1"]                             optional
//   scale = [64 numbers]                                             optional: 8 for each corner, as at a node
//
// `shares` is how versions are said: a version of a node is a node of its own that shares some of the other's
// values.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct MeshBody {
  HermiteMesh mesh;
  std::optional<FibreField> fibres;
};

inline constexpr std::string_view mesh_file_mark = "diastole-mesh";

/// A place inside an element where its volume is not positive, of 27 that are tried.
std::optional<Xi> inside_out_at(const HermiteMesh& mesh, size_t element);

/// Precondition: ties are alike for x, y and z, and between equal derivatives.
std::string mesh_file_text(const MeshBody& body);

/// Throws InputError (file, line, key, value, remedy) for what the format does not know, node numbers that do
/// not exist, shared values that differ, unused nodes, and elements that are inside out.
MeshBody read_mesh_file(const std::filesystem::path& path);
/// The same from text; `name` stands for the file in messages.
MeshBody mesh_from_text(std::string_view text, const std::string& name);

}  // namespace diastole
