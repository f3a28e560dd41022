#pragma once
// XDMF 3 (.xdmf): XML that says what a grid is, with its numbers there or in an HDF5 file beside it. https://www.xdmf.org
// Read are one uniform grid, or a temporal collection of grids, whose points and cells are those of its first. Written as a temporal
// collection, also of one step, with all arrays in NAME.h5 and single numbers (a step's pressure_kPa) as Information.

#include <filesystem>
#include <string>

#include "estimator/grids/field_grid.hpp"

namespace diastole {

/// Throws InputError with the item for whatever is wrong in it.
FieldGrid read_xdmf(const std::string& path);

/// The HDF5 file first, then the XML that names it; each whole or not at all. Throws InputError if one cannot be written.
void write_xdmf(const std::filesystem::path& path, const FieldGrid& grid);
/// The file of numbers beside it.
std::filesystem::path numbers_beside(const std::filesystem::path& path);

}  // namespace diastole
